"""The rig in its workspace with everything that happens at the end effector: the main view of a picture."""

import math

import pygame

from birthsim_env.drawing import pen as d
from birthsim_env.drawing.lettering import Lettering
from birthsim_env.drawing.pen import FINE, Axis, Box, Pen, Point
from birthsim_env.drawing.rig import Pose, Rig
from birthsim_env.drawing.scene import Scene, path_of
from birthsim_env.physics.rig.parameters import Parameters

_LEAST_FORCE = 0.05  # N; below it an arrow would only flicker


class View:
    """View in ``box`` px; all poses of the rig fit above the ``strip`` px at its foot, which are for scale bar and note.

    ``text`` is for force and note, ``small`` for all else; ``unit`` is the scale of line widths, ``margin`` px the free space.
    """

    def __init__(
        self, parameters: Parameters, box: Box, text: Lettering, small: Lettering, unit: float, margin: int, strip: int
    ) -> None:
        self.box, self._text, self._small, self._unit, self._margin = box, text, small, unit, margin
        self._field = Box(box.x, box.y, box.width, box.height - strip)
        self._rig, self._air = Rig(parameters), parameters.air
        self.scale, self.origin = self._fit()
        self._sheet = d.sheet(box)
        self._world = Pen(self._sheet, (self.origin[0] - box.x, self.origin[1] - box.y), self.scale)
        self._scale_bar = Box(box.x + 2 * margin, box.bottom - margin - 2, round(0.1 * self.scale), 4)

    def pixel(self, point: Point) -> Point:
        """Pixel (column, row) of a world point, m; whole numbers are pixel edges."""
        return self.origin[0] + self.scale * point[0], self.origin[1] - self.scale * point[1]

    def _fit(self) -> tuple[float, Point]:
        """Scale (px/m) and pixel of the origin so that all poses fill the field."""
        field, (low, high) = self._field, self._rig.extent()
        room = field.width - 2 * self._margin, field.height - self._margin
        scale = min(room[0] / (high[0] - low[0]), room[1] / (high[1] - low[1]))
        x = field.x + self._margin + room[0] / 2 - scale * (low[0] + high[0]) / 2
        return scale, (x, field.y + self._margin + room[1] / 2 + scale * (low[1] + high[1]) / 2)

    def draw_static(self, fine: pygame.Surface) -> None:
        """Workspace, column and scale bar on the fine background of the whole picture, which is kept for ``draw``."""
        box, bar = self.box, self._scale_bar
        self._rig.draw_ground(Pen(fine, self.origin, self.scale))
        page, right = Pen(fine, (0.0, 0.0), 1.0), bar.x + 0.1 * self.scale
        page.line([(bar.x, 4 - bar.y), (bar.x, -bar.y), (right, -bar.y), (right, 4 - bar.y)], d.INK, 1.5)
        self._background = fine.subsurface((box.x * FINE, box.y * FINE, box.width * FINE, box.height * FINE)).copy()
        self._sheet.blit(self._background, (0, 0))

    def end_effector(self, scene: Scene) -> Point:
        """Where the end effector is, m; NaN where the linkage cannot close."""
        pose = self._rig.pose(scene.piston)
        return pose.end_effector if pose is not None else (math.nan, math.nan)

    def draw(self, picture: pygame.Surface, scene: Scene, window: float) -> None:
        """Draw ``scene`` over the background; ``window`` of the magnifier (m)."""
        pen, unit, path = self._world, self._unit, path_of(scene)
        pose = self._rig.pose(scene.piston)
        # Only what the last picture covered needs cleaning, and only what this one covers is scaled down.
        self._sheet.blit(self._background, pen.touched, pen.touched)
        pen.touched = pygame.Rect(0, 0, 0, 0)
        pen.curve(path, d.PATH, 2.0 * unit)
        if pose is not None:
            self._rig.draw(pen, pose, [d.pressure_colour(pressure, self._air) for pressure in scene.pressures])
        # Once more, thin: the path goes on across head and rod.
        pen.curve(path, d.PATH, 0.8 * unit)
        square = Axis(scene.compliant_target, (1.0, 0.0)).box(-window / 2, window / 2, window / 2)
        pen.line([*square, square[0]], d.GREY, 0.8 * unit)
        size = max(2.8, 3.8 * unit)
        d.target_marker(pen, scene.target, 1.75 * size)
        d.compliant_marker(pen, scene.compliant_target, 1.35 * size)
        label = self._draw_force(scene.user_force, pose) if pose is not None else None
        d.end_effector_marker(pen, pose.end_effector if pose is not None else (math.nan, math.nan), 0.75 * size)
        d.paste(self._sheet, picture, self.box, pen.touched)
        if pose is not None:
            for name, place in self._rig.chamber_names(pose, 0.6 * self._small.height / self.scale):
                self._small.write(picture, name, self.pixel(place), d.INK, (0.5, 0.5), halo=True)
        if label is not None:
            self._text.write(picture, label[0], label[1], d.FORCE, (0.5, 0.5), halo=True)
        self._write_foot(picture, self._rig.note(scene.piston))

    def _write_foot(self, picture: pygame.Surface, note: str) -> None:
        bar, margin, box = self._scale_bar, self._margin, self.box
        self._small.write(picture, "100 mm", (bar.x, bar.y - 5), d.INK, (0.0, 1.0))
        left = max(bar.right, bar.x + self._small.width("100 mm")) + 2 * margin
        fitted = self._text.fit((note,), box.right - margin - left)
        self._text.write(picture, fitted, (box.right - margin, box.bottom - margin), d.FORCE, (1, 1))

    def _draw_force(self, force: tuple[float, float], pose: Pose) -> tuple[str, Point] | None:
        """Arrow of the user's force at the head; returns its label and where that belongs, px."""
        newtons = math.hypot(*force)
        x, y = self.pixel(pose.end_effector)
        if not (_LEAST_FORCE < newtons < math.inf and d.drawable([(x, y)])):
            return None
        dx, dy = force[0] / newtons, -force[1] / newtons
        field, unit, edge = self._field, self._unit, 1.2 * self._rig.head_radius * self.scale
        length = unit * min(14 + 0.8 * newtons, 110)
        label = f"{newtons:.0f} N" if newtons < 1e5 else f"{newtons:.1e} N"
        half = self._text.width(label) / 2 + 4, self._text.height / 2

        def inside(distance: float) -> bool:
            return field.holds((x + dx * distance, y + dy * distance), (4.0, 4.0))

        # Clear of the cylinders where there is room: a pull leaves the head, a force into the machine ends at it as a push.
        pull, push = (edge, edge + length), (-edge - length, -edge)
        into_machine = force[0] * pose.axis2.along[0] + force[1] * pose.axis2.along[1] < -0.5 * newtons
        if into_machine:
            tail, tip = push if inside(push[0]) or not inside(pull[1]) else pull
        else:
            tail, tip = pull if inside(pull[1]) or not inside(push[0]) else push
        start, end = (
            ((x + dx * s - self.origin[0]) / self.scale, (self.origin[1] - y - dy * s) / self.scale) for s in (tail, tip)
        )
        d.arrow(self._world, start, end, 5 * unit)
        free, middle = tip if tail > 0 else tail, (tail + tip) / 2
        beyond = free + math.copysign(abs(dx) * half[0] + abs(dy) * half[1] + 2 * unit, free)
        aside = abs(dy) * half[0] + abs(dx) * half[1] + 8 * unit
        places = [(x + dx * beyond, y + dy * beyond)]
        places += [(x + dx * middle - dy * s, y + dy * middle + dx * s) for s in (aside, -aside)]
        # Off limits, the label stays in the picture on the side where the head has left it.
        return label, next((place for place in places if field.holds(place, half)), field.nearest(places[0], half))
