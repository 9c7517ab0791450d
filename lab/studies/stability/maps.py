"""Where a controller is stable: maps over what it does not know of its rig, and over the hand that holds the end effector.

A hand is a spring to the point where the end effector rests. In the maps of ``MAPS`` it has no mass or damping: what damps it
is the rig. From rest it is pushed with 40 N, more than stiction, for 0.3 s. Five seconds later, for one second, the motion that
remains is judged.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from baselines.bench.pieces import file_stem
from baselines.bench.probes import board_limit
from baselines.controller import Controller
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.loop.signals import REFERENCES, Mask, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, value_of
from lab.studies.stability.rig_port import Port, RigPort

PLACE = (0.5, 0.0)
"""m, the target: the middle of the workspace."""

PNEUMATIC = (4400.0, 2200.0)
"""N/m, what is asked for of the pneumatic stiffness."""

PUSH = (32.0, 24.0)
"""N, assumed: 40 N askew, so that both pistons slip."""

PUSHED, RELEASED, JUDGED, END = 0.5, 0.8, 5.0, 6.0
"""s, assumed: the push begins and ends, judgement begins and ends."""

MOST_MOTION, MOST_FORCE = 5e-4, 5.0
"""m and N, assumed: peak to peak, more is an oscillation; the force is that of the hand, a stiff one feels small motions."""

SETPOINT = 2000.0
"""N/m, of the closed-loop stiffness where it does not vary."""


@dataclass(frozen=True)
class Axis:
    """What varies along one side of a map: values from ``low`` to ``high``, evenly or by equal factors."""

    label: str
    low: float
    high: float
    count: int
    logarithmic: bool = False

    def values(self, points: int | None = None) -> Array:
        """``points`` of them, or ``count``."""
        spread = np.geomspace if self.logarithmic else np.linspace
        return np.asarray(spread(self.low, self.high, points or self.count))


MASS = Axis("mass at the end effector (kg)", 1.5, 6.0, 10)
LAG = Axis("time constant of the valves (ms)", 1.0, 12.0, 12)
HAND = Axis("stiffness of the hand (N/m)", 100.0, 30000.0, 16, logarithmic=True)
ASKED = Axis("closed-loop stiffness asked for (N/m)", 1000.0, 4000.0, 7)
FRICTION = Axis("dry friction, fraction of the believed one", 0.0, 1.5, 13)


@dataclass(frozen=True)
class Cases:
    """N cases: their rigs, the stiffness of the hand (N,) and that asked for (N,), N/m; damping, N s/m, and mass, kg, of the
    hand (N,), none where not given."""

    rigs: Sequence[Parameters]
    hand: Array
    asked: Array
    damping: Array | None = None
    mass: Array | None = None


def _rig_cases(rig: Parameters, lag: Array, mass: Array) -> Cases:
    changed = [rig.replace({"mechanics.mass": m, "valves.time_constant": t / 1e3}) for m, t in zip(mass, lag, strict=True)]
    return Cases(changed, np.zeros(len(lag)), np.full(len(lag), SETPOINT))


def _hand_cases(rig: Parameters, hand: Array, asked: Array) -> Cases:
    return Cases([rig] * len(hand), hand, asked)


def _mass_cases(rig: Parameters, hand: Array, mass: Array) -> Cases:
    return Cases([rig.replace({"mechanics.mass": m}) for m in mass], hand, np.full(len(hand), SETPOINT))


def _friction_cases(rig: Parameters, hand: Array, scale: Array) -> Cases:
    changed = []
    for fraction in scale:
        parts = [f"cylinder{i}.{name}" for i in (1, 2) for name in ("coulomb_friction", "pressure_friction")]
        changed.append(rig.replace({part: fraction * value_of(rig, part) for part in parts}))
    return Cases(changed, hand, np.full(len(hand), SETPOINT))


@dataclass(frozen=True)
class Map:
    """Two axes; ``cases`` of a rig for values (N,) along both, and where on them its controller believes to be."""

    title: str
    x: Axis
    y: Axis
    cases: Callable[[Parameters, Array, Array], Cases]
    believed: Callable[[Parameters], tuple[float | None, float | None]]


MAPS: dict[str, Map] = {
    "rig": Map(
        "A rig that is not as believed, free",
        LAG, MASS, _rig_cases, lambda rig: (1e3 * rig.valves.time_constant, rig.mechanics.mass),
    ),
    "hand": Map("The rig as believed, held by a hand", HAND, ASKED, _hand_cases, lambda rig: (None, None)),
    "hand_friction": Map(
        "Other friction than believed, held by a hand", HAND, FRICTION, _friction_cases, lambda rig: (None, 1.0)
    ),
    "hand_mass": Map(
        "Another mass than believed, held by a hand", HAND, MASS, _mass_cases, lambda rig: (None, rig.mechanics.mass)
    ),
}  # fmt: skip
"""Name -> map."""

VARIANTS: dict[str, dict[str, dict[str, float]]] = {
    "admittance-backstepping": {
        "as it is": {},
        "gains that never yield": {"yielding": 1.0},
        "half the friction fed forward": {"friction_fraction": 0.5},
    }
}
"""Controller -> label -> options, for a figure that compares them; other controllers are as they are."""


@dataclass(frozen=True)
class Verdict:
    """Peak to peak motion of the larger axis in the second that is judged, m, (N,); ``stable`` and ``lost`` (N,); peak to peak
    force at the port in that second, N, (N,), and the most energy that the port had given to the hand at any time, J, (N,)."""

    motion: Array
    stable: Mask
    lost: Mask
    force: Array
    energy: Array


class Window:
    """Mean and span of positions (2, N) over a stretch of time."""

    def __init__(self, lanes: int) -> None:
        self._sum, self._count = np.zeros((2, lanes)), 0
        self._low, self._high = np.full((2, lanes), np.inf), np.full((2, lanes), -np.inf)

    def add(self, position: Array) -> None:
        """Take one instant."""
        self._sum += position
        self._count += 1
        self._low, self._high = np.minimum(self._low, position), np.maximum(self._high, position)

    def mean(self) -> Array:
        """m, (2, N)."""
        return np.asarray(self._sum / self._count)

    def span(self) -> Array:
        """Peak to peak, m, (2, N)."""
        return np.asarray(self._high - self._low)


def judge(
    cases: Cases,
    controller: Controller,
    sensors: str = "ideal",
    seed: int = 0,
    damping_factor: Array | None = None,
    force_sensor: bool = True,
) -> Verdict:
    """Hold, push and release every lane, a case each. ``damping_factor`` (N,) and ``force_sensor`` as in ``RigPort``."""
    rigs, lanes = cases.rigs, len(cases.hand)
    rows = np.zeros((REFERENCES, lanes))
    rows[:2], rows[8:10], rows[10:12] = np.transpose([PLACE]), cases.asked, np.transpose([PNEUMATIC])
    damping, mass = (np.zeros(lanes) if given is None else given for given in (cases.damping, cases.mass))
    port = RigPort(rigs, Reference(rows), controller, sensors, seed, mass, damping_factor, force_sensor)
    verdict = push_and_release(port, rows[:2].copy(), cases.hand, damping)
    lost = verdict.lost | (port.impacts > board_limit(rigs))
    return replace(verdict, stable=verdict.stable & ~lost, lost=lost)


def push_and_release(port: Port, held: Array, stiffness: Array, damping: Array) -> Verdict:
    """What remains at a port of the push, where hands of a stiffness (N,), N/m, and a damping (N,), N s/m, hold it at
    positions ``held`` (2, N), m."""

    def hand(now: float, position: Array, velocity: Array) -> Array:
        push = np.transpose([PUSH]) * float(PUSHED <= now < RELEASED)
        return np.asarray(push - stiffness * (position - held) - damping * velocity)

    motion, force, most = Window(port.lanes), Window(port.lanes), np.zeros(port.lanes)
    for period in range(round(END / port.period)):
        judged = period * port.period >= JUDGED
        if judged:
            motion.add(port.motion()[:2])
        port.advance(hand)
        np.maximum(most, port.energy, out=most)
        if judged:
            force.add(port.force)
    span = motion.span().max(axis=0)
    lost = ~np.isfinite(span)
    with np.errstate(divide="ignore"):
        stable = ~lost & (span < np.minimum(MOST_MOTION, MOST_FORCE / stiffness))
    return Verdict(span, stable, lost, force.span().max(axis=0), most)


def variants_of(controller: str) -> dict[str, dict[str, float]]:
    """Label -> options."""
    return VARIANTS.get(controller, {controller: {}})


def describe_map(key: str, rig: Parameters, points: int | None = None) -> dict[str, Any]:
    """What a map of ``MAPS`` shows, as JSON: the values along ``x`` and ``y``, and where the controller believes itself.

    ``points`` is the number of values along each axis.
    """
    chart = MAPS[key]
    x, y = (
        {"label": axis.label, "values": axis.values(points).tolist(), "logarithmic": axis.logarithmic}
        for axis in (chart.x, chart.y)
    )
    return {"title": chart.title, "x": x, "y": y, "believed": list(chart.believed(rig))}


def draw_map(
    controller: str,
    source: str,
    rig: dict[str, Any],
    key: str,
    options: dict[str, float],
    sensors: str = "ideal",
    points: int | None = None,
    seed: int = 0,
) -> Result:
    """One map for a controller with ``options``: rows over y of ``motion_mm`` (None where lost) and ``stable``.

    ``source`` only tells controllers of different files apart.
    """
    chart, believed = MAPS[key], Parameters.from_dict(rig)
    x, y = chart.x.values(points), chart.y.values(points)
    across, up = (side.ravel() for side in np.meshgrid(x, y))
    verdict = judge(chart.cases(believed, across, up), make_controller(controller, believed, **options), sensors, seed)
    motion, shape = np.where(verdict.lost, np.nan, 1e3 * verdict.motion), (len(y), len(x))
    return {"motion_mm": motion.reshape(shape).tolist(), "stable": verdict.stable.reshape(shape).tolist()}


def stability_tasks(
    maps: Sequence[str], settings: dict[str, Any], sensors: str, points: int | None, seed: int
) -> dict[tuple[str, str], Task]:
    """(map, variant) -> task, for the controller given by its ``controller_settings``."""
    own, name = {"sensors": sensors, "points": points, "seed": seed}, settings["controller"]
    return {
        (key, label): Task(
            f"pieces/{file_stem(name)}/{key}-{file_stem(label)}",
            draw_map,
            {**settings, "key": key, "options": options, **own},
        )
        for key in maps
        for label, options in variants_of(name).items()
    }


def stable_up_to(chart: dict[str, Any], label: str) -> list[float | None]:
    """Per value of y: the largest x at which, and below which, all is stable; None where not even the least is."""
    limits: list[float | None] = []
    for row in chart["variants"][label]["stable"]:
        count = row.index(False) if False in row else len(row)
        limits.append(chart["x"]["values"][count - 1] if count else None)
    return limits
