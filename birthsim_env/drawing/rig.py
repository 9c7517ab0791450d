"""The linkage as a picture: cylinders, pins, fetal head, the column that carries them, and how much room they take."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from birthsim_env.drawing.pen import CAP, FAINT, INK, PAPER, SKIN, SKIN_EDGE, STEEL, Axis, Colour, Pen, Point
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.rig.parameters import Cylinder, Parameters

_NEAR_STOP = 1e-4  # m


@dataclass(frozen=True)
class Barrel:
    """Where the parts of one cylinder lie along its axis, m from the pivot; ``rod`` is the distance from piston to rod end."""

    rear: float
    stroke: float
    cap: float
    half_bore: float
    half_rod: float
    rod: float

    @property
    def front(self) -> float:
        """Far end of the front cap."""
        return self.rear + self.stroke + 2 * self.cap

    def piston(self, y: float) -> float:
        """Where the piston is: the middle of the bore at y = 0."""
        return self.rear + self.cap + self.stroke / 2 + y

    def draw(self, pen: Pen, axis: Axis, y: float, colours: tuple[Colour, Colour]) -> None:
        """Barrel, chambers P (rear) and N in their colours, piston, and the rod as far as it reaches."""
        bore0, bore1 = self.rear + self.cap, self.rear + self.cap + self.stroke
        seat = min(max(self.piston(y), bore0), bore1)
        end = self.piston(y) + self.rod
        thick = min(0.35 * self.half_bore, 0.1 * self.stroke)
        pen.polygon(axis.box(bore0, seat, self.half_bore), colours[0])
        pen.polygon(axis.box(seat, bore1, self.half_bore), colours[1])
        pen.polygon(axis.box(seat, end, self.half_rod), STEEL, INK)
        pen.line([axis.at(seat, 0.4 * self.half_rod), axis.at(end, 0.4 * self.half_rod)], PAPER, 1.0)
        pen.polygon(axis.box(max(seat - thick, bore0), min(seat + thick, bore1), self.half_bore), INK)
        for side in (-self.half_bore, self.half_bore):
            pen.line([axis.at(bore0, side), axis.at(bore1, side)], INK, 2.0)
        for start in (self.rear, bore1):
            pen.polygon(axis.box(start, start + self.cap, 1.25 * self.half_bore), CAP, INK)


def _smooth(corners: Sequence[Point], steps: int) -> list[Point]:
    """Lay a closed Catmull-Rom curve through the corners."""
    t = np.arange(steps) / steps
    weights = np.array([-t + 2 * t**2 - t**3, 2 - 5 * t**2 + 3 * t**3, t + 4 * t**2 - 3 * t**3, t**3 - t**2]) / 2
    around = np.array([np.roll(corners, -k, axis=0) for k in (-1, 0, 1, 2)])
    return [(x, y) for x, y in np.einsum("kt,kid->itd", weights, around).reshape(-1, 2).tolist()]


# Profile in units of the skull's radius: first towards the crown, second towards the face.
PROFILE = _smooth(
    [
        (-0.98, -0.36),
        (-0.62, -0.6),
        (-0.15, -0.99),
        (0.4, -1.07),
        (0.87, -0.76),
        (1.08, -0.2),
        (1.02, 0.32),
        (0.74, 0.76),
        (0.35, 0.94),
        (0.06, 0.92),
        (-0.08, 0.9),
        (-0.26, 1.1),
        (-0.4, 0.92),
        (-0.52, 0.97),
        (-0.64, 0.86),
        (-0.8, 0.8),
        (-0.9, 0.52),
        (-0.78, 0.26),
        (-0.98, 0.14),
    ],
    4,
)
EYE = [(0.02, 0.4), (-0.08, 0.48), (-0.11, 0.57), (-0.08, 0.66), (0.0, 0.73)]
MOUTH = [(-0.58, 0.86), (-0.57, 0.72), (-0.52, 0.6)]
EAR = _smooth([(-0.05, -0.3), (0.02, -0.46), (-0.14, -0.58), (-0.34, -0.5), (-0.42, -0.36), (-0.3, -0.26)], 3)
_HEAD_REAR = 1.05


def head(pen: Pen, axis: Axis, radius: float) -> None:
    """Fetal head in profile around the origin of ``axis``, crown first, face to the right of the axis; ``radius`` m."""

    def placed(shape: Sequence[Point]) -> list[Point]:
        (ox, oy), ax, ay = axis.origin, radius * axis.along[0], radius * axis.along[1]
        return [(ox + s * ax + n * ay, oy + s * ay - n * ax) for s, n in shape]

    pen.polygon(placed(PROFILE), SKIN, SKIN_EDGE, 1.5)
    for feature in (EYE, MOUTH, [*EAR, EAR[0]]):
        pen.line(placed(feature), SKIN_EDGE, 1.2)


@dataclass(frozen=True)
class Pose:
    """The linkage at one instant: piston positions, axes of both cylinders and the points they meet in, m."""

    piston: tuple[float, float]
    axis1: Axis
    axis2: Axis
    joint: Point
    end_effector: Point


class Rig:
    """One rig with everything placed so that nothing collides at either end of the strokes."""

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        g, cylinders = parameters.geometry, (parameters.cylinder1, parameters.cylinder2)
        # The first cylinder that there is: a rail has the second alone.
        self._first = parameters.linkage.topology.cylinders[0]
        self._half1, self._half2 = cylinders[0].stroke / 2, cylinders[1].stroke / 2
        shortest = g.k1 - self._half1, g.k2 - self._half2
        self._reach = g.k2 + self._half2
        self.head_radius = min(0.066 * self._reach, 0.5 * shortest[1])
        clearance = self.head_radius * _HEAD_REAR + 0.003 * self._reach
        self.barrels = (
            self._barrel(cylinders[0], shortest[0] - min(0.065 * self._reach, 0.3 * shortest[0]), g.k1),
            self._barrel(cylinders[1], shortest[1] - clearance, g.k2),
        )

    def _barrel(self, cylinder: Cylinder, front: float, offset: float) -> Barrel:
        """Barrel that ends at ``front`` and whose rod ends ``offset`` m from the pivot at mid stroke."""
        # Bores are drawn 1.6 times as thick as they are: the colour of the air must be seen.
        cap = min(0.028 * self._reach, 0.15 * cylinder.stroke)
        half_bore = min(max(0.8 * cylinder.piston_diameter, 0.02 * self._reach), 0.035 * self._reach)
        half_rod = min(max(0.8 * cylinder.rod_diameter, 0.006 * self._reach), 0.5 * half_bore)
        rear = front - cylinder.stroke - 2 * cap
        return Barrel(rear, cylinder.stroke, cap, half_bore, half_rod, offset - rear - cap - cylinder.stroke / 2)

    def pose(self, piston: tuple[float, float]) -> Pose | None:
        """Pose for piston positions, m; ``None`` where the linkage cannot close or a position is no number."""
        g = self.parameters.geometry
        try:
            theta1 = float(geometry.theta1(piston[0], self.parameters))
        except ValueError:
            return None
        pivot = g.d3 * math.cos(g.gamma3), g.d3 * math.sin(g.gamma3)
        axis2 = Axis((0.0, 0.0), (math.sin(theta1), -math.cos(theta1)))
        joint = axis2.at(g.d6)
        r4 = math.dist(pivot, joint)
        axis1 = Axis(pivot, ((joint[0] - pivot[0]) / r4, (joint[1] - pivot[1]) / r4))
        return Pose(piston, axis1, axis2, joint, axis2.at(g.k2 + piston[1]))

    def _poses(self, count: int) -> list[Pose]:
        """Poses over the whole stroke of cylinder 1, cylinder 2 at mid stroke."""
        travel = 0.0 if self._first else self._half1
        poses = [self.pose((float(y1), 0.0)) for y1 in np.linspace(-travel, travel, count)]
        return [pose for pose in poses if pose is not None]

    def extent(self) -> tuple[Point, Point]:
        """Lower left and upper right corner, m, of all that is drawn of the rig in any pose."""
        first, second = self.barrels
        around, wide, k2 = 1.2 * self.head_radius, 1.3 * second.half_bore, self.parameters.geometry.k2
        points: list[Point] = []
        for pose in self._poses(9):
            for x, y in (pose.axis2.at(k2 - self._half2), pose.axis2.at(k2 + self._half2)):
                points += [(x - around, y - around), (x + around, y + around)]
            for barrel, axis in ((first, pose.axis1), (second, pose.axis2))[self._first :]:
                points += [axis.at(min(barrel.rear, -wide), side) for side in (-wide, wide)]
        xs, ys = zip(*points, strict=True)
        return (min(xs), min(ys)), (max(xs), max(ys))

    def workspace(self) -> list[Point]:
        """Outline of where the end effector can be, m: out along cylinder 2's shortest length, back along its longest."""
        k2, axes = self.parameters.geometry.k2, [pose.axis2 for pose in self._poses(33)]
        return [a.at(k2 - self._half2) for a in axes] + [a.at(k2 + self._half2) for a in reversed(axes)]

    def draw_ground(self, pen: Pen) -> None:
        """Workspace of the end effector and the column that carries both pivots."""
        g = self.parameters.geometry
        pen.polygon(self.workspace(), (241, 244, 240), (214, 221, 212))
        column, half = Axis((0.0, 0.0), (math.cos(g.gamma3), math.sin(g.gamma3))), 0.8 * self.barrels[1].half_bore
        if not self._first:
            pen.polygon(column.box(-2 * half, g.d3 + 2 * half, half), FAINT, (200, 205, 211))

    def draw(self, pen: Pen, pose: Pose, colours: Sequence[Colour]) -> None:
        """Everything that moves; ``colours`` of the chambers P1, N1, P2, N2."""
        first, second = self.barrels
        pins2 = (0.0,) if self._first else (0.0, self.parameters.geometry.d6)
        for barrel, axis, pins in ((first, pose.axis1, (0.0,)), (second, pose.axis2, pins2))[self._first :]:
            for at in pins:
                # Where a pin lies beyond the barrel, a lug on the barrel carries it.
                if at < barrel.rear or at > barrel.front:
                    ends = (at, barrel.rear) if at < barrel.rear else (barrel.front, at)
                    pen.polygon(axis.box(*ends, 0.6 * barrel.half_bore), CAP, INK)
        second.draw(pen, pose.axis2, pose.piston[1], (colours[2], colours[3]))
        if not self._first:
            first.draw(pen, pose.axis1, pose.piston[0], (colours[0], colours[1]))
        pin = 0.45 * pen.scale * second.half_bore
        for place in (pose.axis2.origin, *(() if self._first else (pose.axis1.origin, pose.joint))):
            pen.disc(place, 1.6 * pin, CAP, INK)
            pen.disc(place, 0.8 * pin, STEEL, INK)
        head(pen, Axis(pose.end_effector, pose.axis2.along), self.head_radius)

    def chamber_names(self, pose: Pose, away: float) -> Iterator[tuple[str, Point]]:
        """P1, N1, P2, N2 and their places, m: ``away`` m beside the barrels, on the sides that face away from each other."""
        for i, (barrel, axis, side) in enumerate(zip(self.barrels, (pose.axis1, pose.axis2), (1, -1), strict=True)):
            if i < self._first:
                continue
            aside = side * (1.25 * barrel.half_bore + away)
            yield f"P{i + 1}", axis.at(barrel.rear + 2.2 * barrel.cap, aside)
            yield f"N{i + 1}", axis.at(barrel.front - 2.2 * barrel.cap, aside)

    def note(self, piston: tuple[float, float]) -> str:
        """Say what the picture alone does not say; usually nothing."""
        if self.pose(piston) is None:
            return "no pose: linkage cannot close"
        ends = [str(i + 1) for i, half in enumerate((self._half1, self._half2)) if abs(piston[i]) > half - _NEAR_STOP]
        return f"cylinder{'s' if len(ends) == 2 else ''} {' and '.join(ends)} at end stop" if ends else ""
