"""One picture of the rig: header, main view and side panel."""

from __future__ import annotations

import math

import numpy as np
import pygame

from birthsim_env.drawing import pen as d
from birthsim_env.drawing.panel import Panel, number
from birthsim_env.drawing.pen import FINE, Axis, Box, Lettering, Pen, Point
from birthsim_env.drawing.rig import Pose, Rig
from birthsim_env.drawing.scene import Scene
from birthsim_env.parameters import Parameters

_LEAST_FORCE = 0.05  # N; below it an arrow would only flicker


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
        self._view = view = Box(0, header, width - side, height - header)
        # The strip below belongs to the scale bar and the notes.
        self._field = Box(view.x, view.y, view.width, view.height - self._text.height - 2 * margin)
        self._panel = Panel(Box(width - side, header, side, height - header), parameters.air, self._small, unit, margin)
        self._status = self._status_columns()

        self._rig = Rig(parameters)
        self.scale, self.origin = self._fit()
        self._sheet = d.sheet(view)
        self._world = Pen(self._sheet, (self.origin[0] - view.x, self.origin[1] - view.y), self.scale)
        self._scale_bar = Box(view.x + 2 * margin, height - margin - 2, round(0.1 * self.scale), 4)
        self.surface = pygame.Surface((width, height), 0, 32)
        self._background = pygame.Surface((width, height), 0, 32)
        self._draw_background()

    def pixel(self, point: Point) -> Point:
        """Pixel (column, row) of a world point, m, in the main view; whole numbers are pixel edges."""
        return self.origin[0] + self.scale * point[0], self.origin[1] - self.scale * point[1]

    def _fit(self) -> tuple[float, Point]:
        """Scale (px/m) and pixel of the origin so that all poses fill the field."""
        field, (low, high) = self._field, self._rig.extent()
        room = field.width - 2 * self._margin, field.height - self._margin
        scale = min(room[0] / (high[0] - low[0]), room[1] / (high[1] - low[1]))
        x = field.x + self._margin + room[0] / 2 - scale * (low[0] + high[0]) / 2
        return scale, (x, field.y + self._margin + room[1] / 2 + scale * (low[1] + high[1]) / 2)

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
        fine, view, bar = d.sheet(Box(0, 0, self.width, self.height)), self._view, self._scale_bar
        fine.fill(d.PAPER)
        self._rig.draw_ground(Pen(fine, self.origin, self.scale))
        fine.fill((240, 243, 246), (0, 0, self.width * FINE, view.y * FINE))
        page = Pen(fine, (0.0, 0.0), 1.0)
        page.line([(0, -view.y), (self.width, -view.y)], d.FAINT)
        self._panel.draw_static(page)
        ends = bar.x, bar.x + 0.1 * self.scale
        page.line([(ends[0], 4 - bar.y), (ends[0], -bar.y), (ends[1], -bar.y), (ends[1], 4 - bar.y)], d.INK, 1.5)
        d.paste(fine, self._background, Box(0, 0, self.width, self.height))
        self._panel.write_static(self._background)
        area = view.x * FINE, view.y * FINE, view.width * FINE, view.height * FINE
        self._view_background = fine.subsurface(area).copy()
        self._sheet.blit(self._view_background, (0, 0))

    def draw(self, scene: Scene) -> None:
        """Draw ``scene`` on ``surface``."""
        pen, unit, picture = self._world, self._unit, self.surface
        pose = self._rig.pose(scene.piston)
        end_effector = pose.end_effector if pose is not None else (math.nan, math.nan)
        path = np.asarray(scene.path, dtype=np.float64).reshape(-1, 2)
        picture.blit(self._background, (0, 0))
        # Only what the last picture covered needs cleaning, and only what this one covers is scaled down.
        self._sheet.blit(self._view_background, pen.touched, pen.touched)
        pen.touched = pygame.Rect(0, 0, 0, 0)
        pen.curve(path, d.PATH, 2.0 * unit)
        if pose is not None:
            self._rig.draw(pen, pose, [self._panel.colour(pressure) for pressure in scene.pressures])
        # Once more, thin: the path goes on across head and rod.
        pen.curve(path, d.PATH, 0.8 * unit)
        window = self._panel.window(scene.compliant_target, (scene.target, end_effector))
        square = Axis(scene.compliant_target, (1.0, 0.0)).box(-window / 2, window / 2, window / 2)
        pen.line([*square, square[0]], d.GREY, 0.8 * unit)
        size = max(2.8, 3.8 * unit)
        d.target_marker(pen, scene.target, 1.75 * size)
        d.compliant_marker(pen, scene.compliant_target, 1.35 * size)
        label = self._draw_force(scene.user_force, pose) if pose is not None else None
        d.end_effector_marker(pen, end_effector, 0.75 * size)
        d.paste(self._sheet, picture, self._view, pen.touched)

        if pose is not None:
            for name, place in self._rig.chamber_names(pose, 0.6 * self._small.height / self.scale):
                self._small.write(picture, name, self.pixel(place), d.INK, (0.5, 0.5), halo=True)
        if label is not None:
            self._text.write(picture, label[0], label[1], d.FORCE, (0.5, 0.5), halo=True)
        self._panel.draw_magnifier(picture, scene.target, scene.compliant_target, end_effector, path, self.scale)
        self._panel.draw_pressures(picture, scene.pressures)
        self._write_header(scene, end_effector)
        self._write_footer(self._rig.note(scene.piston))

    def _write_header(self, scene: Scene, end_effector: Point) -> None:
        margin, picture = self._margin, self.surface
        title = " ".join(scene.title.replace("\0", " ").split()) or "BirthSIM"
        self._heading.write(picture, self._heading.fit((title,), self.width - 4 * margin), (2 * margin, margin))
        error = end_effector[0] - scene.compliant_target[0], end_effector[1] - scene.compliant_target[1]
        top = margin + self._heading.height + round(3 * self._unit)
        texts = self._status_texts(scene.time, error, scene.stiffness)
        for (x, width), text in zip(self._status, texts, strict=True):
            self._text.write(picture, self._text.fit((text,), width), (x, top))

    def _write_footer(self, note: str) -> None:
        bar, margin = self._scale_bar, self._margin
        self._small.write(self.surface, "100 mm", (bar.x, bar.y - 5), d.INK, (0.0, 1.0))
        left = max(bar.right, bar.x + self._small.width("100 mm")) + 2 * margin
        fitted = self._text.fit((note,), self._view.right - margin - left)
        self._text.write(self.surface, fitted, (self._view.right - margin, self.height - margin), d.FORCE, (1, 1))

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
