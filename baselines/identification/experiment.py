"""An experiment that excites what is to be identified: a target for any position law, and openings to add to the law's.

The target is a multisine of both pistons through most of their strokes: long travel tells the dead volume from the flow, the
weight and the accelerations tell the mass, reversals and speeds from zero to 0.3 m/s tell the friction. The openings that are
added to those of the law, steps of random size and length, tell conductance and lag of the valves. The pneumatic stiffness that
is asked of the law goes up and down: with it goes the sum of a cylinder's pressures, which tells the friction that grows with
them from the one that does not. The law keeps the pistons away from the end stops, so that the experiment is safe where the law
is.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from birthsim_env.files import write_text
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.parts.courses import check_points
from birthsim_env.parts.points import Through
from birthsim_env.parts.stiffness_schedules import SOFTEST, STIFFEST
from birthsim_env.parts.times import unit_of
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import end_effector
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import checked_number
from birthsim_env.tables.columns import LARGEST, columns
from birthsim_env.tables.reading import read_table
from birthsim_env.tables.table import Reading

GRID = 0.01
"""s between the rows of a plan."""

TRAVEL = 0.65
"""Fraction of half a stroke that the target takes; the rest is for what the law does not follow. Assumed."""

FREQUENCIES = (0.11, 0.23, 0.41, 0.73, 1.27, 1.91)
"""Hz, assumed: no one is a multiple of another. The amplitude falls as 1/f, so that all add the same to the speed."""

RISE = 1.0
"""s that the target takes to leave its start and, at the end, to rest."""

STEP = 0.3
"""Largest opening that is added to the law's, assumed."""

HELD = (2, 8)
"""Shortest and longest time for which an added opening is held, in rows of the plan."""

SOFT, STIFF = 0.6, 1.4
"""Least and largest pneumatic stiffness over that of ``PNEUMATIC``; assumed. Beyond, valves saturate."""

PNEUMATIC = (4400.0, 2200.0)
"""N/m asked of the pneumatic stiffness of cylinders 1 and 2 in the mean."""

STIFFNESS = 3000.0
"""N/m asked of the law in both directions; laws that know no stiffness ignore it."""

MARGIN = 1e-9
"""s by which a time may lack rounding's share of a period."""

CYCLES = (2.0, 3.0)
"""Times that the stiffness of cylinder 1 and that of cylinder 2 go up and down in a plan."""

ADDED = ("added_P1", "added_N1", "added_P2", "added_N2")
NAMES = {"time": "s", "x": "m", "y": "m", **dict.fromkeys(ADDED, "1")}
"""Columns of a plan and their units; the last four are openings in [-1, 1] that are added to the law's."""

ASKED = {"stiffness_1": "N/m", "stiffness_2": "N/m"}
"""Columns that a plan may lack, with pneumatic stiffness setpoints of cylinders 1 and 2 for a law that knows them."""

SHORTEST, DURATION, LONGEST = 4.0, 12.0, 600.0
"""s of a plan: the shortest, one that is proposed, with which the table of docs/identify.md is made, and the longest."""


@dataclass(frozen=True)
class Plan:
    """Rows of an experiment: ``times`` (T,), s, ``target`` (2, T), m, ``added`` (4, T), openings, each held until the next, and
    pneumatic ``stiffness`` (2, T), N/m, straight in between; without, it is ``PNEUMATIC``."""

    times: Array
    target: Array
    added: Array
    stiffness: Array | None = None

    def asked(self) -> Array:
        """The pneumatic stiffness (2, T) of every row."""
        held = np.repeat(np.transpose([PNEUMATIC]), len(self.times), axis=1)
        return held if self.stiffness is None else self.stiffness

    def periods(self, period: float) -> tuple[Array, Array, Array]:
        """Of its K control periods of ``period`` s: times (K,), s, references (15, K), and openings to add (4, K).

        Its rows are those of a multisine, which passes them between two of them; cut to its rows it would jerk there.
        """
        start = self.times[0]
        ends = start + period * np.arange(int((self.times[-1] - start) / period) + 1)
        times = ends[:-1]
        rows = np.zeros((REFERENCES, len(times)))
        rows[:8], rows[8:10] = Through(self.times, self.target.T, within=False).sample(times), STIFFNESS
        stiffness = np.array([np.interp(ends, self.times, one) for one in self.asked()])
        rows[10:12], rows[12:14] = stiffness[:, :-1], np.diff(stiffness) / period
        return times, rows, np.ascontiguousarray(self.added[:, np.searchsorted(self.times, times + MARGIN) - 1])

    def write(self, path: Path) -> None:
        """Write the plan as CSV with the columns ``NAMES`` and ``ASKED``."""
        rows = np.vstack([self.times, self.target, self.added, self.asked()]).T
        lines = [",".join((*NAMES, *ASKED)), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
        write_text(path, "\n".join(lines) + "\n")


def propose(rig: Parameters, duration: float, seed: int = 0) -> Plan:
    """An experiment of ``duration`` s for a rig, known as far as its strokes; ``seed`` draws phases and added openings."""
    checked_number("duration", duration, "s", least=SHORTEST, most=LONGEST)
    rng = np.random.default_rng(seed)
    times: Array = GRID * np.arange(round(duration / GRID) + 1, dtype=np.float64)
    ramp = np.clip(np.minimum(times, times[-1] - times) / RISE, 0.0, 1.0)
    ramp = ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
    piston = np.array([_multisine(times, 0.5 * one.stroke, rng) * ramp for one in (rig.cylinder1, rig.cylinder2)])
    added = np.array([_steps(len(times), rng) for _ in range(4)]) * (ramp >= 1.0)
    idle = [k for k in range(4) if k not in rig.linkage.topology.chambers]
    added[idle], piston[[k // 2 for k in idle]] = 0.0, 0.0
    return Plan(times, end_effector(piston, rig), added, _stiffness(times))


def suited(plan: Plan, rig: Parameters) -> Plan:
    """The plan with the pneumatic stiffness at which a rig's chambers have the pressures that the default one's have in it.

    At mid stroke the stiffness of a cylinder is proportional to pressure times piston areas over stroke (9): what is soft for a
    short narrow cylinder would empty the chambers of a long wide one. On the default rig it is the plan itself.
    """
    return replace(plan, stiffness=plan.asked() * np.transpose([_reach(rig) / _reach(Parameters())]))


def _reach(rig: Parameters) -> Array:
    """Supply pressure times piston areas over stroke of both cylinders (2,), N/m."""
    areas = np.array([(one.area_p + one.area_n) / one.stroke for one in (rig.cylinder1, rig.cylinder2)])
    return np.asarray(rig.air.supply_pressure * areas)


def _stiffness(times: Array) -> Array:
    """Pneumatic stiffness (2, T), N/m: from the mean up and down, geometrically."""
    part = (times - times[0]) / (times[-1] - times[0])
    waves = np.sin(2 * np.pi * np.outer(CYCLES, part))
    high, low = np.log(STIFF), -np.log(SOFT)
    return np.asarray(np.transpose([PNEUMATIC]) * np.exp(np.where(waves > 0, high, low) * waves))


def _multisine(times: Array, half_stroke: float, rng: np.random.Generator) -> Array:
    """A sum of sines (T,), m, whose extremes lie ``TRAVEL`` of the way to the end stops."""
    waves = [np.sin(2 * np.pi * (f * times + rng.uniform())) / f for f in FREQUENCIES]
    total = np.sum(waves, axis=0)
    return np.asarray(TRAVEL * half_stroke * total / np.abs(total).max())


def _steps(rows: int, rng: np.random.Generator) -> Array:
    """Openings (rows,) of random size, each held for a random time."""
    held = rng.integers(HELD[0], HELD[1] + 1, size=rows)
    return np.repeat(rng.uniform(-STEP, STEP, size=rows), held)[:rows]


def read_plan(path: Path, rig: Parameters) -> Plan:
    """The plan that ``Plan.write`` wrote; ``ValueError`` names what is wrong with the file, also for this rig."""
    table = read_table("plan", Path(path), Reading(most=LARGEST))
    names = (*NAMES, *(ASKED if set(ASKED) <= set(table.columns) else ()))
    where, found = f"plan = {str(path)!r}", columns("plan", (Path(path), ""), NAMES | ASKED, names).T
    times, target, added, stiffness = found[0], found[1:3], found[3:7], found[7:]
    if len(times) < 8:
        raise ValueError(f"{where} has {len(times)} rows; allowed: at least 8")
    if not abs(times[0]) <= LONGEST:
        guess = unit_of(times, DURATION)
        raise ValueError(f"{where} begins at {times[0]:.10g} s{guess}; allowed: within {LONGEST:g} s of 0")
    if not SHORTEST <= times[-1] - times[0] <= LONGEST:
        guess = unit_of(times, DURATION)
        raise ValueError(f"{where} lasts {times[-1] - times[0]:.4g} s{guess}; allowed: {SHORTEST:g} to {LONGEST:g} s")
    if np.abs(added).max() > 1:
        raise ValueError(f"{where}: an added opening of {np.abs(added).max():g}; allowed: -1 to 1")
    try:
        through = Through(times - times[0], target.T)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error
    check_points(where, through, times[-1] - times[0], rig)
    if len(stiffness) and not (SOFTEST <= stiffness.min() <= stiffness.max() <= STIFFEST):
        raise ValueError(f"{where}: a stiffness of {stiffness.min():g} N/m; allowed: {SOFTEST:g} to {STIFFEST:g}")
    return Plan(times, target, added, stiffness if len(stiffness) else None)
