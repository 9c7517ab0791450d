"""Two runs of the same world beside each other: rig, magnifier and tracking error over time of each, to the same scales."""

import math
from collections.abc import Sequence

import numpy as np
import pygame
from numpy.typing import NDArray

from birthsim_env.drawing import pen as d
from birthsim_env.drawing.lettering import Lettering
from birthsim_env.drawing.magnifier import Magnifier
from birthsim_env.drawing.pen import FINE, Box, Pen, Point, number
from birthsim_env.drawing.scene import Scene
from birthsim_env.drawing.view import View
from birthsim_env.physics.rig.parameters import Parameters

WINDOW = 0.02
"""m: width of both magnifiers."""


class Half:
    """One of the two, in ``box`` px: ``name`` of what runs, and axes for its error over ``span`` s up to ``top`` m."""

    def __init__(self, parameters: Parameters, box: Box, name: str, span: tuple[float, float], top: float, unit: float) -> None:
        self.box, self._name, self._span, self._top, self._unit = box, name, span, top, unit
        self._margin = margin = round(8 * unit)
        self._text, self._small = Lettering(round(14 * unit)), Lettering(round(13 * unit))
        self._heading = Lettering(round(15 * unit), bold=True)
        head, side = self._heading.height + 2 * margin, round(0.36 * box.width)
        height = box.height - head - side - self._small.height - 2 * margin
        view = Box(box.x, box.y + head, box.width, height)
        self._view = View(parameters, view, self._heading, self._small, 0.9 * unit, margin, self._small.height + margin)
        square = Box(box.x + 2 * margin, box.bottom - margin - side, side, side)
        self._magnifier = Magnifier(square, self._small, 0.9 * unit)
        left = square.right + round(4.5 * margin)
        foot = self._small.height + margin // 2
        self._plot = Box(left, square.y, box.right - 2 * margin - left, square.height - foot)
        self._sheet = d.sheet(self._plot)
        ticks = [0.001 * k for k in (0, 1, 2, 5, 10, 20, 50, 100, 200)]
        step = next((tick for tick in ticks[1:] if top / tick <= 5), ticks[-1])
        self._ticks = np.arange(0.0, top + 1e-9, step)

    def draw_static(self, fine: pygame.Surface) -> None:
        """Draw what never changes on the fine background of the whole picture."""
        self._view.draw_static(fine)
        page, plot = Pen(fine, (0.0, 0.0), 1.0), self._plot
        fine.fill((255, 255, 255), (plot.x * FINE, plot.y * FINE, plot.width * FINE, plot.height * FINE))
        for tick in self._ticks:
            page.line([(plot.x, -self._row(tick)), (plot.right, -self._row(tick))], d.FAINT)
        page.line([(plot.x, -plot.y), (plot.x, -plot.bottom), (plot.right, -plot.bottom)], d.CAP)

    def write_static(self, picture: pygame.Surface) -> None:
        """Name, ticks and title of the axes."""
        box, plot, margin, small = self.box, self._plot, self._margin, self._small
        self._heading.write(picture, self._name, (box.x + 2 * margin, box.y + margin))
        small.write(picture, "tracking error, mm", (plot.x, plot.y - 2), d.INK, (0, 1))
        for tick in self._ticks:
            small.write(picture, f"{1e3 * tick:g}", (plot.x - margin // 2, self._row(tick)), d.INK, (1, 0.5))
        # Seconds stand apart, and none at either end, where the axes' own numbers are.
        begin, end = self._span
        step = math.ceil(1.6 * small.width("10 s") * (end - begin) / plot.width)
        for second in range(math.floor(begin) + step, math.ceil(end), step):
            small.write(picture, f"{second} s", (self._column(second), plot.bottom + 2), d.INK, (0.5, 0))

    def draw(self, picture: pygame.Surface, scene: Scene, times: NDArray[np.float64], errors: NDArray[np.float64]) -> None:
        """Draw one instant, and the error (m) at all ``times`` (s) so far."""
        end_effector = self._view.end_effector(scene)
        self._view.draw(picture, scene, WINDOW)
        self._magnifier.draw(picture, scene, end_effector, WINDOW, self._view.scale)
        error = f"error {number(1e3 * errors[-1], '.1f')} mm"
        at = self.box.right - 2 * self._margin, self.box.y + self._margin
        self._heading.write(picture, error, at, d.INK, (1, 0))
        plot = self._plot
        self._sheet.blit(picture_part(picture, plot), (0, 0))
        pen = Pen(self._sheet, (-plot.x, -plot.y), 1.0)
        rows = [self._row(min(error, self._top)) for error in errors]
        pen.curve(np.array([[self._column(t), -row] for t, row in zip(times, rows, strict=True)]), d.INK, 1.6 * self._unit)
        d.end_effector_marker(pen, (self._column(times[-1]), -rows[-1]), 3.0 * self._unit)
        d.paste(self._sheet, picture, plot)

    def _column(self, time: float) -> float:
        begin, end = self._span
        return self._plot.x + self._plot.width * (time - begin) / (end - begin)

    def _row(self, error: float) -> float:
        return self._plot.bottom - self._plot.height * error / self._top


def picture_part(picture: pygame.Surface, box: Box) -> pygame.Surface:
    """A box of the picture, as fine as a sheet."""
    part = picture.subsurface((box.x, box.y, box.width, box.height))
    return pygame.transform.scale(part, (box.width * FINE, box.height * FINE))


class Pair:
    """Picture ``width`` px wide of two runs, ``names`` above them; ``title`` over both, the scales as in ``Half``."""

    def __init__(
        self, parameters: Parameters, title: str, names: Sequence[str], span: tuple[float, float], top: float, width: int = 960
    ) -> None:
        self._unit = unit = width / 960
        self.width, self.height = width, round(0.66 * width / 2) * 2
        self._title, self._margin = title, round(8 * unit)
        self._text, self._heading = Lettering(round(13 * unit)), Lettering(round(17 * unit), bold=True)
        top_strip, foot = self._heading.height + 2 * self._margin, self._text.height + 2 * self._margin
        height, half = self.height - top_strip - foot, width // 2
        self._header, self._foot = top_strip, self.height - foot
        boxes = [Box(k * half, top_strip, half, height) for k in (0, 1)]
        self._halves = [Half(parameters, box, name, span, top, unit) for box, name in zip(boxes, names, strict=True)]
        self.surface = pygame.Surface((width, self.height), 0, 32)
        self._background = pygame.Surface((width, self.height), 0, 32)
        self._draw_background()

    def _draw_background(self) -> None:
        everything = Box(0, 0, self.width, self.height)
        fine = d.sheet(everything)
        fine.fill(d.PAPER)
        for top, bottom in ((0, self._header), (self._foot, self.height)):
            fine.fill((240, 243, 246), (0, top * FINE, self.width * FINE, (bottom - top) * FINE))
        page, middle = Pen(fine, (0.0, 0.0), 1.0), self.width / 2
        for half in self._halves:
            half.draw_static(fine)
        page.line([(middle, -self._header), (middle, -self._foot)], d.GREY)
        marks = self._legend(page)
        d.paste(fine, self._background, everything)
        margin = self._margin
        self._heading.write(self._background, self._title, (2 * margin, margin))
        for word, x in marks:
            self._text.write(self._background, word, (x, (self._foot + self.height) / 2), d.INK, (0, 0.5))
        for half in self._halves:
            half.write_static(self._background)

    def _legend(self, page: Pen) -> list[tuple[str, float]]:
        """Draw the markers at the foot; returns the words beside them and where these begin, px."""
        y, size, x, words = -(self._foot + self.height) / 2, 5.0 * self._unit, 3.0 * self._margin, []
        for word in ("end effector", "compliant target: target + force / stiffness", "target", "user force"):
            place: Point = (x, y)
            if word == "end effector":
                d.end_effector_marker(page, place, size)
            elif word == "target":
                d.target_marker(page, place, size)
            elif word == "user force":
                d.arrow(page, (x - size, y), (x + 3 * size, y), 4 * self._unit)
                x += 2 * size
            else:
                d.compliant_marker(page, place, 1.2 * size)
            words.append((word, x + 2 * size))
            x += 2 * size + self._text.width(word) + 5 * self._margin
        return words

    def frame(
        self, scenes: Sequence[Scene], times: NDArray[np.float64], errors: Sequence[NDArray[np.float64]]
    ) -> NDArray[np.uint8]:
        """Draw both scenes, with the errors (m) at the ``times`` (s) so far, as (height, width, 3) RGB."""
        picture, margin = self.surface, self._margin
        picture.blit(self._background, (0, 0))
        for half, scene, error in zip(self._halves, scenes, errors, strict=True):
            half.draw(picture, scene, times, error)
        pull = f"pull {number(math.hypot(*scenes[0].user_force), '.0f')} N    t = {number(scenes[0].time, '.1f')} s"
        self._heading.write(picture, pull, (self.width - 2 * margin, margin), d.INK, (1, 0))
        return d.pixels(picture)
