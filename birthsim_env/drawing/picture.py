"""One picture of the rig: header, main view and side panel."""

import math

import numpy as np
import pygame
from numpy.typing import NDArray

from birthsim_env.drawing import pen as d
from birthsim_env.drawing.lettering import Lettering
from birthsim_env.drawing.panel import Panel
from birthsim_env.drawing.pen import FINE, Box, Pen, Point, number
from birthsim_env.drawing.scene import Scene
from birthsim_env.drawing.view import View
from birthsim_env.physics.rig.parameters import Parameters


class Picture:
    """Lays a picture of ``width`` x ``height`` px out for one rig; ``draw`` then fills ``surface``."""

    def __init__(self, parameters: Parameters, width: int, height: int) -> None:
        self.width, self.height = width, height
        self._unit = unit = min(width / 640, height / 480)
        self._margin = margin = max(4, round(8 * unit))
        self._text = Lettering(max(10, round(12 * unit)))
        self._small = Lettering(max(9, round(11 * unit)))
        self._heading = Lettering(max(11, round(14 * unit)), bold=True)
        header = self._heading.height + self._text.height + 2 * margin + round(3 * unit)
        side = round(min(0.27 * width, 0.45 * height))
        box = Box(0, header, width - side, height - header)
        self._view = View(parameters, box, self._text, self._small, unit, margin, self._text.height + 2 * margin)
        self._panel = Panel(Box(width - side, header, side, height - header), parameters.air, self._small, unit, margin)
        self._status = self._status_columns()
        self.surface = pygame.Surface((width, height), 0, 32)
        self._background = pygame.Surface((width, height), 0, 32)
        self._draw_background()

    def to_pixel(self, point: Point) -> Point:
        """Pixel (column, row) of a world point, m, in the main view; whole numbers are pixel edges."""
        return self._view.pixel(point)

    def _status_columns(self) -> list[tuple[int, int]]:
        """Start and width, px, of the three texts of the status line; the wording follows the room there is."""
        gap = 2 * self._margin
        for self._verbose in (True, False):
            samples = self._status_texts(999.99, (0.9999, 0.0999), (9999.0, 9999.0))
            widths = [self._text.width(text) for text in samples]
            if sum(widths) + 4 * gap <= self.width:
                break
        starts = [gap, 2 * gap + widths[0], 3 * gap + widths[0] + widths[1]]
        return [(starts[0], widths[0]), (starts[1], widths[1]), (starts[2], self.width - starts[2] - self._margin)]

    def _status_texts(self, time: float, error: Point, stiffness: Point) -> tuple[str, str, str]:
        size = number(1e3 * math.hypot(*error), ".1f")
        ex, ey = (number(1e3 * part, "+.1f") for part in error)
        kx, ky = (number(part, ".0f") for part in stiffness)
        if self._verbose:
            return f"t = {number(time, '.2f')} s", f"error {size} mm (x {ex}, y {ey})", f"stiffness x {kx}, y {ky} N/m"
        return f"t {number(time, '.2f')} s", f"error {size} mm", f"K {kx}, {ky} N/m"

    def _draw_background(self) -> None:
        """All that never changes."""
        fine, header = d.sheet(Box(0, 0, self.width, self.height)), self._view.box.y
        fine.fill(d.PAPER)
        fine.fill((240, 243, 246), (0, 0, self.width * FINE, header * FINE))
        page = Pen(fine, (0.0, 0.0), 1.0)
        page.line([(0, -header), (self.width, -header)], d.FAINT)
        self._panel.draw_static(page)
        self._view.draw_static(fine)
        d.paste(fine, self._background, Box(0, 0, self.width, self.height))
        self._panel.write_static(self._background)

    def frame(self, scene: Scene) -> NDArray[np.uint8]:
        """Draw the picture of ``scene`` as (height, width, 3) RGB; a fresh array each time."""
        self.draw(scene)
        return d.pixels(self.surface)

    def draw(self, scene: Scene) -> None:
        """Draw ``scene`` on ``surface``."""
        picture, magnifier, end_effector = self.surface, self._panel.magnifier, self._view.end_effector(scene)
        window = magnifier.window(scene.compliant_target, (scene.target, end_effector))
        picture.blit(self._background, (0, 0))
        self._view.draw(picture, scene, window)
        magnifier.draw(picture, scene, end_effector, window, self._view.scale)
        self._panel.draw_pressures(picture, scene.pressures)
        self._write_header(scene, end_effector)

    def _write_header(self, scene: Scene, end_effector: Point) -> None:
        margin, picture = self._margin, self.surface
        title = " ".join(scene.title.replace("\0", " ").split()) or "BirthSIM"
        self._heading.write(picture, self._heading.fit((title,), self.width - 4 * margin), (2 * margin, margin))
        error = end_effector[0] - scene.compliant_target[0], end_effector[1] - scene.compliant_target[1]
        top = margin + self._heading.height + round(3 * self._unit)
        texts = self._status_texts(scene.time, error, scene.stiffness)
        for (x, width), text in zip(self._status, texts, strict=True):
            self._text.write(picture, self._text.fit((text,), width), (x, top))
