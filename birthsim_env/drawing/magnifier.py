"""The magnifier: surroundings of the compliant target, where millimetres can be seen."""

import math
from collections.abc import Sequence

import pygame

from birthsim_env.drawing import pen as d
from birthsim_env.drawing.lettering import Lettering
from birthsim_env.drawing.pen import Axis, Box, Colour, Pen, Point
from birthsim_env.drawing.scene import Scene, path_of

_WINDOWS = (0.02, 0.04, 0.08, 0.16)  # widths it may show by itself, m


class Magnifier:
    """Magnifier in the square ``box`` px, its magnification and grid written above; ``unit`` is the scale of line widths."""

    def __init__(self, box: Box, text: Lettering, unit: float) -> None:
        self.box, self._text, self._unit = box, text, unit
        self._sheet = d.sheet(box)

    @staticmethod
    def window(centre: Point, others: Sequence[Point]) -> float:
        """Width of the magnifier's window around ``centre``, m: the smallest that holds the ``others`` too."""
        offsets = [abs(p - c) for other in others for p, c in zip(other, centre, strict=True)]
        offset = max([value for value in offsets if math.isfinite(value)], default=0.0)
        return next((window for window in _WINDOWS if offset <= 0.42 * window), _WINDOWS[-1])

    def draw(self, picture: pygame.Surface, scene: Scene, end_effector: Point, window: float, main_scale: float) -> None:
        """Show ``window`` m around the compliant target; ``main_scale`` is that of the rig, px/m."""
        box, unit, target, compliant_target = self.box, self._unit, scene.target, scene.compliant_target
        places = (compliant_target, end_effector, target)
        centre = next((place for place in places if d.drawable([place])), (0.0, 0.0))
        scale, half, step = box.width / window, window / 2, window / 4
        pen = Pen(self._sheet, (box.width / 2 - scale * centre[0], box.width / 2 + scale * centre[1]), scale)
        frame = Axis(centre, (1.0, 0.0))
        self._sheet.fill((255, 255, 255))
        for i in (-1, 0, 1):
            pen.line([frame.at(i * step, -half), frame.at(i * step, half)], d.FAINT)
            pen.line([frame.at(-half, i * step), frame.at(half, i * step)], d.FAINT)
        pen.curve(path_of(scene), d.PATH, 2.0 * unit)
        pen.line([compliant_target, end_effector], d.GREY, 1.2 * unit)
        size = max(3.5, 6 * unit)
        d.target_marker(pen, target, 1.5 * size)
        d.compliant_marker(pen, compliant_target, 1.3 * size)
        d.end_effector_marker(pen, end_effector, 0.7 * size)
        for place, colour in ((target, d.TARGET), (end_effector, d.END_EFFECTOR)):
            self._point_out(pen, frame, place, window, colour)
        edge = 0.497 * window
        border = frame.box(-edge, edge, edge)
        pen.line([*border, border[0]], d.CAP)
        d.paste(self._sheet, picture, box)
        times, grid = f"{scale / main_scale:.0f} times", f"grid {1e3 * step:.0f} mm"
        heading = self._text.fit((f"magnified {times}, {grid}", f"{times}, {grid}", grid), box.width)
        self._text.write(picture, heading, (box.x, box.y - 2), d.INK, (0, 1))

    def _point_out(self, pen: Pen, frame: Axis, place: Point, window: float, colour: Colour) -> None:
        """Draw a triangle at the magnifier's edge that points to what lies outside it."""
        dx, dy = place[0] - frame.origin[0], place[1] - frame.origin[1]
        far = max(abs(dx), abs(dy))
        if not 0.5 * window < far < math.inf:
            return
        size, angle = max(5.0, 8 * self._unit), math.atan2(-dy, dx)
        corners = [(size * math.cos(angle + turn), size * math.sin(angle + turn)) for turn in (0.0, 2.4, -2.4)]
        pen.shape(frame.at(0.44 * window * dx / far, 0.44 * window * dy / far), corners, colour, d.PAPER)
