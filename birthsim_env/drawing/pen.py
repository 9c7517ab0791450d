"""Primitives: colours, a pen in metres that skips whatever is not finite, markers and the force arrow."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pygame
from numpy.typing import NDArray

from birthsim_env.physics.rig.parameters import Air

Point = tuple[float, float]
Colour = tuple[int, int, int]

PAPER: Colour = (250, 251, 252)
INK: Colour = (38, 44, 52)
GREY: Colour = (128, 136, 146)
FAINT: Colour = (222, 226, 231)
STEEL: Colour = (196, 202, 209)
CAP: Colour = (92, 100, 110)
SKIN: Colour = (246, 214, 190)
SKIN_EDGE: Colour = (158, 104, 74)
# The markers differ in luminance (about 15, 95 and 165 of 255) as well as in hue and shape, so they survive a grey print.
END_EFFECTOR: Colour = (14, 14, 18)
TARGET: Colour = (0, 112, 128)
COMPLIANT: Colour = (255, 150, 0)
PATH: Colour = (176, 184, 194)
FORCE: Colour = (196, 16, 72)
LOW_PRESSURE: Colour = (240, 246, 252)
HIGH_PRESSURE: Colour = (14, 52, 128)

# SDL keeps coordinates in integers; far beyond any surface nothing can be seen anyway.
_LARGEST_PIXEL = 30000.0
# Surfaces are drawn this many times finer than the picture and scaled down: that smooths every edge.
FINE = 2


def mix(low: Colour, high: Colour, fraction: float) -> Colour:
    """Colour ``fraction`` (0 to 1, clipped) of the way from ``low`` to ``high``; grey where ``fraction`` is not a number."""
    if math.isnan(fraction):
        return STEEL
    fraction = min(max(fraction, 0.0), 1.0)
    red, green, blue = (round(a + fraction * (b - a)) for a, b in zip(low, high, strict=True))
    return red, green, blue


def pressure_fraction(pressure: float, air: Air) -> float:
    """0 at atmospheric pressure, 1 at supply pressure."""
    low, high = air.atmospheric_pressure, air.supply_pressure
    return float(pressure - low) / (high - low)


def pressure_colour(pressure: float, air: Air) -> Colour:
    """Colour of air at an absolute pressure, Pa."""
    return mix(LOW_PRESSURE, HIGH_PRESSURE, pressure_fraction(pressure, air))


def number(value: float, form: str) -> str:
    """Format a number for the screen; a dash where there is none."""
    return format(value, form) if math.isfinite(value) else "-"


def drawable(points: Iterable[Point]) -> bool:
    """Whether all points (pixels) are finite and near enough for SDL."""
    for x, y in points:  # noqa: SIM110 - a generator would take twice as long, 80 times a frame
        if not (-_LARGEST_PIXEL < x < _LARGEST_PIXEL and -_LARGEST_PIXEL < y < _LARGEST_PIXEL):
            return False
    return True


@dataclass(frozen=True)
class Box:
    """A rectangle of the picture, px."""

    x: int
    y: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """Column just past the box."""
        return self.x + self.width

    @property
    def bottom(self) -> int:
        """Row just past the box."""
        return self.y + self.height

    def holds(self, at: Point, half: Point) -> bool:
        """Whether a rectangle with half sizes ``half`` around ``at`` lies inside."""
        across = self.x + half[0] <= at[0] <= self.right - half[0]
        return across and self.y + half[1] <= at[1] <= self.bottom - half[1]

    def nearest(self, at: Point, half: Point) -> Point:
        """``at`` moved as little as puts a rectangle with half sizes ``half`` around it inside."""
        return (
            min(max(at[0], self.x + half[0]), self.right - half[0]),
            min(max(at[1], self.y + half[1]), self.bottom - half[1]),
        )


def sheet(box: Box) -> pygame.Surface:
    """Make a fine surface for one box of the picture."""
    return pygame.Surface((box.width * FINE, box.height * FINE), 0, 32)


def paste(fine: pygame.Surface, picture: pygame.Surface, box: Box, part: pygame.Rect | None = None) -> None:
    """Scale a fine surface, or the ``part`` of it (fine px) that has changed, down into its box of the picture."""
    if part is None:
        part = fine.get_rect()
    left, top = part.left // FINE, part.top // FINE
    right, bottom = min(-(-part.right // FINE), box.width), min(-(-part.bottom // FINE), box.height)
    if right > left and bottom > top:
        size = right - left, bottom - top
        source = fine.subsurface((left * FINE, top * FINE, size[0] * FINE, size[1] * FINE))
        pygame.transform.smoothscale(source, size, picture.subsurface((box.x + left, box.y + top, *size)))


def pixels(surface: pygame.Surface) -> NDArray[np.uint8]:
    """A fresh copy of a picture (height, width, 3), RGB."""
    width, height = surface.get_size()
    copied = np.empty((height, width, 3), dtype=np.uint8)
    # SDL converts into the array itself, five times as fast as by way of bytes.
    pygame.image.frombuffer(copied.data, (width, height), "RGB").blit(surface, (0, 0))
    return copied


@dataclass(frozen=True)
class Axis:
    """A direction in the plane: ``at(s, n)`` is the point ``s`` m along it and ``n`` m to its left."""

    origin: Point
    along: Point

    def at(self, s: float, n: float = 0.0) -> Point:
        """World point (x, y), m."""
        (ox, oy), (ax, ay) = self.origin, self.along
        return ox + s * ax - n * ay, oy + s * ay + n * ax

    def box(self, start: float, end: float, half: float) -> list[Point]:
        """Corners of the rectangle from ``start`` to ``end`` along the axis, ``half`` m to either side."""
        return [self.at(start, half), self.at(end, half), self.at(end, -half), self.at(start, -half)]


class Pen:
    """Draws in world coordinates (m, y up) on a fine surface.

    Widths and radii named ``..._px`` are pixels of the final picture. ``touched`` encloses all that has been drawn, fine px.
    """

    def __init__(self, surface: pygame.Surface, origin: Point, pixels_per_metre: float) -> None:
        """``origin`` is where world (0, 0) lies and ``pixels_per_metre`` the scale, both in final pixels."""
        self.surface, self.scale = surface, pixels_per_metre
        self.touched = pygame.Rect(0, 0, 0, 0)
        self._x, self._y = origin[0] * FINE, origin[1] * FINE
        self._scale = pixels_per_metre * FINE

    def pixel(self, point: Point) -> Point:
        """Fine pixel of a world point (m)."""
        return self._x + self._scale * point[0], self._y - self._scale * point[1]

    def polygon(self, points: Sequence[Point], fill: Colour, edge: Colour | None = None, edge_px: float = 1.0) -> None:
        """Draw a filled polygon of world points (m), optionally outlined."""
        pixels = self._pixels(points)
        if drawable(pixels):
            self._touch(pygame.draw.polygon(self.surface, fill, pixels))
            if edge is not None:
                self._touch(pygame.draw.lines(self.surface, edge, True, pixels, self._width(edge_px)))

    def line(self, points: Sequence[Point], colour: Colour, px: float = 1.0) -> None:
        """Open polyline of world points (m)."""
        pixels = self._pixels(points)
        if drawable(pixels):
            self._touch(pygame.draw.lines(self.surface, colour, False, pixels, self._width(px)))

    def curve(self, points: NDArray[np.float64], colour: Colour, px: float = 1.0) -> None:
        """Open polyline of many world points (M, 2), m, broken where a point cannot be drawn."""
        pixels = np.array([self._x, self._y]) + points * np.array([self._scale, -self._scale])
        seen = (np.abs(pixels) < _LARGEST_PIXEL).all(axis=1)
        edges = np.flatnonzero(seen[1:] != seen[:-1]) + 1
        runs = zip(np.split(pixels, edges), np.split(seen, edges), strict=True) if edges.size else [(pixels, seen)]
        for run, visible in runs:
            if len(run) > 1 and visible[0]:
                self._touch(pygame.draw.lines(self.surface, colour, False, run.tolist(), self._width(px)))

    def disc(
        self, centre: Point, radius_px: float, fill: Colour | None, edge: Colour | None = None, edge_px: float = 1.0
    ) -> None:
        """Disc or, without ``fill``, ring around a world point (m)."""
        pixel = self.pixel(centre)
        if drawable([pixel]):
            if fill is not None:
                self._touch(pygame.draw.circle(self.surface, fill, pixel, radius_px * FINE))
            if edge is not None:
                self._touch(pygame.draw.circle(self.surface, edge, pixel, radius_px * FINE, self._width(edge_px)))

    def shape(self, centre: Point, corners_px: Sequence[Point], fill: Colour, edge: Colour | None = None) -> None:
        """Draw a filled polygon whose corners are pixel offsets (y down) from a world point (m)."""
        x, y = self.pixel(centre)
        pixels = [(x + dx * FINE, y + dy * FINE) for dx, dy in corners_px]
        if drawable(pixels):
            self._touch(pygame.draw.polygon(self.surface, fill, pixels))
            if edge is not None:
                self._touch(pygame.draw.lines(self.surface, edge, True, pixels, FINE))

    def _pixels(self, points: Sequence[Point]) -> list[Point]:
        x0, y0, scale = self._x, self._y, self._scale
        return [(x0 + scale * x, y0 - scale * y) for x, y in points]

    def _touch(self, drawn: pygame.Rect) -> None:
        self.touched = self.touched.union(drawn) if self.touched.width else drawn

    def _width(self, px: float) -> int:
        return max(1, round(px * FINE))


def target_marker(pen: Pen, at: Point, size: float) -> None:
    """Draw a hollow ring with four ticks, ``size`` px in radius: it leaves free what lies inside it."""
    pen.disc(at, size + 1, None, PAPER, 0.3 * size + 2)
    inner, outer, half = 0.95 * size, 1.6 * size, max(0.6, 0.13 * size)
    tick = [(inner, half), (outer, half), (outer, -half), (inner, -half)]
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        pen.shape(at, [(dx * r + dy * h, dy * r + dx * h) for r, h in tick], TARGET)
    pen.disc(at, size, None, TARGET, max(1.2, 0.26 * size))


def compliant_marker(pen: Pen, at: Point, size: float) -> None:
    """Draw a filled diamond, ``size`` px from centre to corner."""
    pen.shape(at, [(size, 0), (0, size), (-size, 0), (0, -size)], COMPLIANT, INK)


def end_effector_marker(pen: Pen, at: Point, size: float) -> None:
    """Draw a black dot with a light rim, ``size`` px in radius."""
    pen.disc(at, size + 0.8, PAPER)
    pen.disc(at, size, END_EFFECTOR)


def arrow(pen: Pen, start: Point, end: Point, px: float) -> None:
    """Draw a force arrow between two world points (m), shaft ``px`` wide, with a light rim to lift it off what lies below."""
    length = math.dist(start, end)
    if not (length > 0 and math.isfinite(length)):
        return
    axis = Axis(start, ((end[0] - start[0]) / length, (end[1] - start[1]) / length))
    wide = px / pen.scale
    neck, half = max(length - 3.2 * wide, 0.0), wide / 2
    left = [axis.at(0, half), axis.at(neck, half), axis.at(neck, 3.2 * half)]
    right = [axis.at(neck, -3.2 * half), axis.at(neck, -half), axis.at(0, -half)]
    outline = [*left, end, *right]
    pen.line([*outline, outline[0]], PAPER, 3.0)
    pen.polygon(outline, FORCE)
