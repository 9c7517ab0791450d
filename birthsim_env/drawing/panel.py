"""The panel beside the rig: magnifier, legend and chamber pressures."""

import math
from collections.abc import Sequence

import pygame

from birthsim_env.drawing import pen as d
from birthsim_env.drawing.lettering import Lettering
from birthsim_env.drawing.magnifier import Magnifier
from birthsim_env.drawing.pen import FINE, Box, Pen, number
from birthsim_env.physics.rig.parameters import Air


class Panel:
    """Side panel in ``box`` px; ``unit`` is the scale of line widths and ``margin`` the space around things, px."""

    def __init__(self, box: Box, air: Air, text: Lettering, unit: float, margin: int) -> None:
        self.box, self._air, self._text, self._unit, self._margin = box, air, text, unit, margin
        self._row = row = text.height + max(1, round(3 * unit))
        # A low picture does without the pressure bars before the magnifier becomes too small to be of use.
        legend, scale = 5 * row, 3 * row
        most = box.height - legend - scale - row - 3 * margin
        size = min(box.width - 2 * margin, max(most, 40))
        self._gauges = most - 4 * row >= 0.85 * size
        if self._gauges:
            size = min(size, most - 4 * row)
        inset = Box(box.x + (box.width - size) // 2, box.y + row + margin // 2, size, size)
        self.magnifier = Magnifier(inset, text, unit)
        bottom = box.bottom - scale - (4 * row if self._gauges else 0) - margin // 2
        top = inset.bottom + margin
        self._legend_top = top + max(0, (bottom - top - legend) // 2)
        label, value = text.width("P1") + margin, text.width("0.00") + margin // 2
        self._track = Box(box.x + margin + label, bottom + row, box.width - 2 * margin - label - value, row)
        self._bar = Box(self._track.x, self._track.y + (4 * row if self._gauges else 0), self._track.width, round(0.6 * row))

    def draw_static(self, page: Pen) -> None:
        """Legend markers and colour bar on the fine background; ``page`` counts px from the top left corner, y up."""
        box, bar, row = self.box, self._bar, self._row
        page.surface.fill((244, 246, 248), (box.x * FINE, box.y * FINE, box.width * FINE, box.height * FINE))
        page.line([(box.x, -box.y), (box.x, -box.bottom)], d.FAINT)
        middle, size = box.x + self._margin + 1.1 * row, 0.26 * row
        ends = middle - 0.7 * row, middle + 0.7 * row
        rows = [-(self._legend_top + (i + 0.5) * row) for i in range(5)]
        d.end_effector_marker(page, (middle, rows[0]), size)
        d.compliant_marker(page, (middle, rows[1]), 1.2 * size)
        d.target_marker(page, (middle, rows[2]), 1.05 * size)
        page.line([(x, rows[3]) for x in ends], d.PATH, 2.0 * self._unit)
        d.arrow(page, (ends[0], rows[4]), (ends[1], rows[4]), 3.5 * self._unit)
        for x in range(bar.width):
            colour = d.mix(d.LOW_PRESSURE, d.HIGH_PRESSURE, (x + 0.5) / bar.width)
            page.surface.fill(colour, ((bar.x + x) * FINE, bar.y * FINE, FINE, bar.height * FINE))
        corners = [(bar.x, -bar.y), (bar.right, -bar.y), (bar.right, -bar.bottom), (bar.x, -bar.bottom)]
        page.line([*corners, corners[0]], d.CAP)

    def write_static(self, picture: pygame.Surface) -> None:
        """Words of legend and colour bar."""
        text, left = self._text, self.box.x + self._margin
        words = ("end effector", "effector"), ("compliant target", "compliant"), ("target",), ("path",), ("user force", "force")
        indent = left + 2.2 * self._row
        room = self.box.right - 2 - indent
        for i, choices in enumerate(words):
            at = indent, self._legend_top + (i + 0.5) * self._row
            text.write(picture, text.fit(choices, room), at, d.INK, (0, 0.5))
        titles = "chamber pressure, bar abs.", "pressure, bar abs.", "pressure, bar"
        title = text.fit(titles, self.box.width - 2 * self._margin)
        text.write(picture, title, (left, self._track.y - self._row))
        for pressure, anchor in ((self._air.atmospheric_pressure, 0.0), (self._air.supply_pressure, 1.0)):
            at = self._bar.x + anchor * self._bar.width, self._bar.bottom + 1
            text.write(picture, f"{pressure / 1e5:.1f}", at, d.INK, (anchor, 0))

    def draw_pressures(self, picture: pygame.Surface, pressures: Sequence[float]) -> None:
        """One bar per chamber, P1, N1, P2, N2 (Pa), on the scale of the colour bar below them."""
        if not self._gauges:
            return
        track, row = self._track, self._row
        for i, (name, pressure) in enumerate(zip(("P1", "N1", "P2", "N2"), pressures, strict=True)):
            top, fraction = track.y + i * row, d.pressure_fraction(pressure, self._air)
            picture.fill(d.FAINT, (track.x, top + 2, track.width, row - 5))
            if math.isfinite(fraction):
                length = round(min(max(fraction, 0.0), 1.0) * track.width)
                picture.fill(d.CAP, (track.x, top + 2, min(length + 1, track.width), row - 5))
                picture.fill(d.pressure_colour(pressure, self._air), (track.x, top + 3, length, row - 7))
            self._text.write(picture, name, (self.box.x + self._margin, top + row / 2), d.INK, (0, 0.5))
            value = number(pressure / 1e5, ".1f") if not pressure > 99e5 else "> 99"
            self._text.write(picture, value, (self.box.right - self._margin, top + row / 2), d.INK, (1, 0.5))
