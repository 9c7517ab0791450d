"""Where the fetal head is during the second stage of labour, and how stiffly it is held there: a small mechanical model.

The paper's last future work is a biomechanical model that gives targets and stiffness. This one is one-dimensional along the
pelvic axis. The file that it writes holds time, x, y and stiffness:

    python examples/labour.py labour.csv

writes a labour of six contractions, twenty-five times as fast as at a birth, and renders it from there. A laboratory with a
better model puts its output into such a file instead; the commands take it too:

    birthsim evaluate --env BirthSIM/Descent-v2 --reference labour.csv --stiffness labour.csv ...

- Driving force: pressures on the head's cross-section, ``F = pi d^2 / 4 (p_contraction + p_push)``. A contraction is a
  ``sin^4`` over its duration, and so is each push; the pushes stand in its middle.
- Tissue gives way for good: ``damping dp/dt = g(F - Y(p))``, where ``p`` is the lasting progress along the axis, m, and ``Y``
  the force that the tissue bears at rest. ``g(x) = x^3 / (x^2 + w^2)`` above 0, else 0: a twice differentiable ``max(x, 0)``.
- Tissue springs back: the head stands at ``s = p + F / k(p)`` along the axis, so it recedes between pushes. ``k`` is the
  stiffness that a hand on the head feels.
- ``Y`` and ``k`` rise from their values above the pelvic floor to those on it by a minimum-jerk step. At the outlet ``p`` is
  held: ``Y`` rises by ``hold`` per metre past it.
- The axis: straight, then an arc (the curve of Carus), whose curvature rises over ``blend`` by the same step. So position,
  velocity and acceleration are continuous.

Work of the driving force is stored in the spring or spent on progress: with constant ``k``, ``int F ds`` equals
``F^2 / (2 k) + int F dp``.

The model neglects the head's mass (quasi-static: 3 kg at these accelerations take less than 0.1 N at real speed), rotation,
moulding and the different paths of head and shoulders.
"""

import math
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.named import make_controller
from birthsim_env import ForceProfile, Parameters
from birthsim_env.parts.own_parts import stepped
from birthsim_env.parts.points import Through
from birthsim_env.parts.references import LONGEST
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.values import checked_count, checked_number

STEP = 0.1
"""s: longest step of the integration, by Runge and Kutta's fourth-order method; a push takes 100 of them."""

CELL = 1e-3
"""m of the axis between the points from which positions are integrated; Gauss' five points then err by rounding alone."""


@dataclass(frozen=True)
class Labour:
    """Constants of the model, SI units; what has no source beside it is assumed. ``ValueError`` names what cannot be."""

    contractions: int = 6
    """Assumed; a first birth takes more, 1 to 2 h of them (Brookside Press, Military Obstetrics and Gynecology)."""
    interval: float = 150.0
    """s from one contraction to the next; 2 to 4 min in the second stage (textbooks for parents, DK)."""
    lasts: float = 60.0
    """s; 60 to 90 s in the second stage (the same)."""
    pushes: int = 3
    """Per contraction; three or four (Brookside Press)."""
    push_lasts: float = 10.0
    """s (Brookside Press)."""
    breath: float = 4.0
    """s between two pushes; assumed."""
    contraction_pressure: float = 8e3
    """Pa, 60 mmHg; assumed. Grimm, Ann Biomed Eng 49:1819 (2021), doi 10.1007/s10439-020-02718-3, reviews measurements."""
    push_pressure: float = 8e3
    """Pa on top, 120 mmHg in all; assumed (the same review)."""
    head_diameter: float = 0.095
    """m across, biparietal, of a term head; assumed."""
    yield_force: float = 35.0
    """N that the tissue above the pelvic floor bears; assumed: more than nothing, less than a contraction gives."""
    floor_yield_force: float = 60.0
    """N on the pelvic floor; assumed: a contraction alone, 57 N, no longer moves the head there."""
    yield_width: float = 5.0
    """N, ``w`` of ``g``; assumed."""
    damping: float = 11e3
    """N s/m; assumed, so that six contractions bring the head to the outlet."""
    stiffness: float = 3500.0
    """N/m above the pelvic floor; assumed, within the 1000 to 5000 N/m that the rig renders."""
    floor_stiffness: float = 5000.0
    """N/m on the pelvic floor; assumed."""
    floor_begins: float = 0.05
    """m of progress, station 0, where the head meets the pelvic floor; assumed."""
    floor_ends: float = 0.11
    """m, where it stands on it; assumed."""
    outlet: float = 0.165
    """m where the head crowns and is held; assumed."""
    hold: float = 2e4
    """N/m; assumed."""
    start_x: float = 0.42
    """m at station -5 cm; assumed, as in ``BirthSIM/Descent-v2``, and so are the four below."""
    start_y: float = -0.04
    heading: float = 0.0
    """rad from x."""
    straight: float = 0.10
    """m, station -5 to +5 cm."""
    radius: float = 0.07
    """m of the arc."""
    blend: float = 0.02
    """m over which the curvature rises; assumed."""

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if isinstance(one.default, int):
                object.__setattr__(self, one.name, checked_count(one.name, value, 1, 1000))
            else:
                least = -10.0 if one.name in ("start_x", "start_y", "heading") else 0.0
                object.__setattr__(self, one.name, checked_number(one.name, value, "SI", least=least, most=LONGEST))
        for name in ("lasts", "push_lasts", "yield_width", "damping", "stiffness", "floor_stiffness", "radius", "blend"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name} = 0; allowed: more than 0")
        if not self._pushing <= self.lasts <= self.interval:
            raise ValueError(
                f"lasts = {self.lasts:g} s; allowed: from {self._pushing:g} s, what its pushes take, to interval = "
                f"{self.interval:g} s"
            )
        if not self.floor_begins < self.floor_ends:
            raise ValueError(f"floor_ends = {self.floor_ends:g} m; allowed: more than floor_begins = {self.floor_begins:g} m")

    @property
    def _pushing(self) -> float:
        return self.pushes * self.push_lasts + (self.pushes - 1) * self.breath

    @property
    def duration(self) -> float:
        """s of real time: contractions and what lies between them."""
        return self.contractions * self.interval

    def pressure(self, time: Array) -> Array:
        """Pa on the head, (M,), at ``time`` (M,), s."""
        since = np.where(time < self.duration, np.mod(time, self.interval), self.lasts)
        begins = (self.lasts - self._pushing) / 2 + np.arange(self.pushes) * (self.push_lasts + self.breath)
        pushed = sum(_bump(since - begin, self.push_lasts) for begin in begins)
        return np.asarray(self.contraction_pressure * _bump(since, self.lasts) + self.push_pressure * pushed)

    def force(self, time: Array) -> Array:
        """N that drives the head, (M,), at ``time`` (M,), s."""
        return np.asarray(math.pi / 4 * self.head_diameter**2 * self.pressure(time))

    def borne(self, progress: Array) -> Array:
        """``Y``: N that the tissue bears at rest, (M,), at ``progress`` (M,), m."""
        held = self.hold * np.maximum(progress - self.outlet, 0.0)
        return np.asarray(self.yield_force + (self.floor_yield_force - self.yield_force) * self._floor(progress) + held)

    def felt(self, progress: Array) -> Array:
        """``k``: stiffness that a hand feels, N/m, (M,), at ``progress`` (M,), m."""
        return np.asarray(self.stiffness + (self.floor_stiffness - self.stiffness) * self._floor(progress))

    def _floor(self, progress: Array) -> Array:
        return _step((progress - self.floor_begins) / (self.floor_ends - self.floor_begins))

    def rate(self, progress: Array, force: Array) -> Array:
        """``dp/dt``, m/s, (M,), under ``force`` (M,), N."""
        spare = np.maximum(force - self.borne(progress), 0.0)
        return np.asarray(spare**3 / (spare**2 + self.yield_width**2) / self.damping)

    def progress(self, time: Array, force: Array) -> Array:
        """Lasting progress, m, (M,), at equally spaced ``time`` (M,), s; ``force`` (2 M - 1,), N, there and half-way."""
        p, steps, least = np.zeros(1), float(time[1] - time[0]), min(self.yield_force, self.floor_yield_force)
        reached = [0.0]
        for k in range(len(time) - 1):
            begin, middle, end = force[2 * k : 2 * k + 3]
            if max(begin, middle, end) <= least:
                reached.append(float(p[0]))
                continue
            k1 = self.rate(p, begin)
            k2 = self.rate(p + steps / 2 * k1, middle)
            k3 = self.rate(p + steps / 2 * k2, middle)
            p = p + steps / 6 * (k1 + 2 * k2 + 2 * k3 + self.rate(p + steps * k3, end))
            reached.append(float(p[0]))
        return np.array(reached)

    def position(self, along: Array) -> Array:
        """x and y, m, (2, M), at the distances ``along`` the axis (M,), m, from station -5 cm."""
        nodes, weights = np.polynomial.legendre.leggauss(5)

        def piece(start: Any, length: Any) -> Any:
            turned = self._turned(start + length / 2 * (1 + nodes[:, None]))
            return length / 2 * np.stack([weights @ np.cos(turned), weights @ np.sin(turned)])

        cells = CELL * np.arange(int(max(along.max(), 0.0) / CELL) + 1)
        corners = np.cumsum(np.hstack([np.zeros((2, 1)), piece(cells, np.full(len(cells), CELL))]), axis=1)
        k = np.maximum(along / CELL, 0.0).astype(np.intp)
        start = np.array([[self.start_x], [self.start_y]])
        return np.asarray(start + corners[:, k] + piece(CELL * k, along - CELL * k))

    def _turned(self, along: Array) -> Array:
        """Direction of the axis, rad: the integral of its curvature, with the minimum-jerk step's own integral."""
        u = np.clip((along - self.straight) / self.blend, 0.0, 1.0)
        risen = u**4 * (2.5 + u * (u - 3.0)) + np.maximum((along - self.straight) / self.blend - 1.0, 0.0)
        return np.asarray(self.heading + self.blend / self.radius * risen)

    def course(self, faster: float = 1.0, period: float = 0.02) -> Array:
        """Rows (M, 4) of time (s), x, y (m) and stiffness (N/m), every ``period`` s; time runs ``faster`` than at a birth."""
        checked_number("faster", faster, "1", least=1e-3, most=1e3)
        checked_number("period", period, "s", least=1e-3, most=1.0)
        count = math.ceil(self.duration / faster / period)
        between = max(1, math.ceil(period * faster / STEP))
        fine = np.linspace(0.0, count * period * faster, count * between + 1)
        force = self.force(np.linspace(0.0, fine[-1], 2 * count * between + 1))
        progress = self.progress(fine, force)[::between]
        stiffness = self.felt(progress)
        x, y = self.position(progress + force[:: 2 * between] / stiffness)
        return np.column_stack([period * np.arange(count + 1), x, y, stiffness])

    def write(self, path: str | Path, faster: float = 1.0, period: float = 0.02) -> None:
        """``course`` as a CSV file, which the environments take as ``reference`` and as ``stiffness``."""
        rows = self.course(faster, period).tolist()
        lines = ["time,x,y,stiffness", *(",".join(map(repr, row)) for row in rows)]
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")

    def parts(self, faster: float = 1.0, period: float = 0.02) -> tuple[Through, StiffnessSchedule]:
        """``course`` as a trajectory and a stiffness schedule, equal to those of the file that ``write`` makes."""
        rows = self.course(faster, period)
        return Through(rows[:, 0], rows[:, 1:3]), stepped(rows[:, 0], rows[:, 3])


def _bump(since: Array, lasts: float) -> Array:
    """sin^4 over ``lasts`` s, 0 outside; three times differentiable."""
    inside = (since > 0.0) & (since < lasts)
    return np.asarray(np.where(inside, np.sin(math.pi * since / lasts) ** 4, 0.0))


def _step(u: Array) -> Array:
    """From 0 at u = 0 to 1 at u = 1 at minimum jerk."""
    u = np.clip(u, 0.0, 1.0)
    return np.asarray(u**3 * (10.0 + u * (6.0 * u - 15.0)))


def main(file: str, faster: float = 25.0) -> None:
    """Write the model's course, and let two controllers render it."""
    labour = Labour()
    labour.write(file, faster)
    for name in ("backstepping", "admittance-backstepping"):
        controller = make_controller(name, Parameters())
        world = {"reference": file, "stiffness": file, "duration": labour.duration / faster, "user_force": ForceProfile()}
        result = evaluate("BirthSIM/Descent-v2", controller, name, 1, 0, False, **world)
        print(f"{name}: settled error {result.metrics['settled_rms'][0]:.3g} mm, air {result.metrics['air'][0]:.3g} l/min")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "labour.csv")
