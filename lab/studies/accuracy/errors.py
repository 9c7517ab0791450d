"""Error of the plant's integrator: against step, method and tolerance, over the rigs that domain randomisation draws.

The reference is ``second_model``: the same rig in other coordinates, integrated by SciPy's DOP853 to a tolerance of 1e-11. It
holds the relaxation of bristles as the plant does, whose step is what is measured; what that alone moves, micrometres where
bristles are ten times stiffer than the default rig's, no step mends (``tests/physics/test_second_model.py``). The error of a
run is the largest difference at any of its 10 ms marks.
"""

import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from birthsim_env.parts.drawn.randomization import checked_ranges, documented_ranges, draw_parameters
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.lanes import SPOOLS, Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.runge_kutta import STAGES
from birthsim_env.physics.step import STEP
from lab.studies.accuracy.motions import PERIOD, PERIODS, Motion, smooth
from lab.studies.accuracy.second_model import SecondModel

STEPS = (1e-3, 0.5e-3, dynamics.INTEGRATION_STEP, 0.125e-3, 0.0625e-3)
"""s; the third is the plant's."""

SMOOTH_STEPS = (1e-3, 0.5e-3, 0.25e-3, 0.125e-3)
"""s; from these the order of convergence is observed."""
SMOOTH_SPEED, SMOOTH_TIME = (0.12, -0.2), 0.04
"""m/s of both pistons at the start of the smooth motion, and its length, s."""
SHUT = (0.0, 0.0, 0.0, 0.0)

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
"""Relative tolerances of the adaptive methods; the absolute one is a thousandth of it, in units of ``second_model.SCALES``."""
ADAPTIVE = ("RK45", "DOP853", "Radau")

LAWS = ("lugre", "coulomb", "elasto_plastic")
"""Friction laws, of which ranges of randomisation know nothing: each is measured on the nominal rig."""
HELD = {"lugre": STEP.relaxation_limit, "elasto_plastic": STEP.elasto_plastic_limit}
"""1/s at which a law holds the relaxation of a bristle."""


@dataclass(frozen=True)
class Course:
    """What N rigs did: end effector (m), (K, 2, N), and pressures (Pa), (K, 4, N), at K marks; lanes that met no end stop."""

    position: Array
    pressure: Array
    clear: Array


NOWHERE = Course(np.full((PERIODS, 2, 1), np.nan), np.full((PERIODS, 4, 1), np.nan), np.array([False]))
"""The reference of a rig that meets an end stop, which the second model has not."""

Advance = Callable[[Plant, Array, Array, float, float], None]
"""Plant, commands (4, N), pushes (2, N), duration and step (s): advances the plant's state in place."""


def runge_kutta(plant: Plant, command: Array, push: Array, duration: float, step: float) -> None:
    """The plant's own kernel, with another step."""
    steps = round(duration / step)
    dynamics.advance(plant.state, command, push[None], plant.lane_parameters, steps, duration / steps, plant.impacts)


def heun(plant: Plant, command: Array, push: Array, duration: float, step: float) -> None:
    """Heun's method of second order, on the plant's right-hand side."""
    first, second, x = np.empty_like(plant.state), np.empty_like(plant.state), plant.state
    for _ in range(round(duration / step)):
        dynamics.derivatives(x, command, push, plant.lane_parameters, first)
        dynamics.derivatives(x + step * first, command, push, plant.lane_parameters, second)
        x += 0.5 * step * (first + second)


def euler(plant: Plant, command: Array, push: Array, duration: float, step: float) -> None:
    """Euler's explicit method, on the plant's right-hand side."""
    first, x = np.empty_like(plant.state), plant.state
    for _ in range(round(duration / step)):
        dynamics.derivatives(x, command, push, plant.lane_parameters, first)
        x += step * first


SHIPPED = f"Runge-Kutta {STAGES}"
METHODS: dict[str, Advance] = {"Euler": euler, "Heun": heun, SHIPPED: runge_kutta}
EVALUATIONS = {"Euler": 1, "Heun": 2, SHIPPED: STAGES}
"""Evaluations of the right-hand side in a step, which are the orders too."""


def rigs_to_measure(nominal: Parameters, draws: int, seed: int) -> dict[str, Parameters]:
    """The nominal rig, two extreme corners of its ranges of randomisation, ``draws`` random corners and as many random rigs.

    ``quick`` has the least mass, dead volume and valve lag and the largest of everything else; ``slow`` the opposite.
    """
    ranges, rng = documented_ranges(nominal), np.random.default_rng(seed)
    checked_ranges(ranges, nominal)
    small = {"mechanics.mass", "chambers.dead_volume", "valves.time_constant"}
    quick = {name: low if name in small else high for name, (low, high) in ranges.items()}
    slow = {name: high if name in small else low for name, (low, high) in ranges.items()}
    rigs = {"nominal": nominal, "quick corner": nominal.replace(quick), "slow corner": nominal.replace(slow)}
    for k in range(draws):
        rigs[f"corner {k + 1}"] = nominal.replace({name: float(rng.choice(bounds)) for name, bounds in sorted(ranges.items())})
    for k in range(draws):
        rigs[f"draw {k + 1}"] = draw_parameters(nominal, ranges, rng)
    return rigs


def run_method(
    rigs: Iterable[Parameters],
    motion: Motion,
    advance: Advance,
    step: float,
    speed: tuple[float, float] = (0.0, 0.0),
    period: float = PERIOD,
    periods: int = PERIODS,
    spools: tuple[float, ...] = SHUT,
) -> Course:
    """The course of rigs, one per lane, through a motion by ``advance`` with steps of ``step`` s."""
    plant = start(list(rigs), speed, spools)
    positions, pressures, clear = [], [], np.full(plant.num_envs, True)
    half = np.array([[0.5 * r.cylinder1.stroke for r in rigs], [0.5 * r.cylinder2.stroke for r in rigs]])
    with np.errstate(all="ignore"):  # a method may be unstable, and then says so by numbers that are none
        for k in range(periods):
            command, push = (np.repeat(row[:, None], plant.num_envs, axis=1) for row in motion(k))
            advance(plant, command, push, period, step)
            positions.append(plant.end_effector()[:2])
            pressures.append(plant.pressures)
            clear &= ~np.any((np.abs(plant.piston) > half) | (plant.impacts > 0), axis=0)
    return Course(np.array(positions), np.array(pressures), clear)


def run_reference(
    rig: Parameters,
    motion: Motion,
    speed: tuple[float, float] = (0.0, 0.0),
    period: float = PERIOD,
    periods: int = PERIODS,
    method: str = "DOP853",
    tolerance: float | None = None,
    spools: tuple[float, ...] = SHUT,
) -> tuple[Course, int]:
    """The course of one rig by the second model, and how often it evaluated its equations.

    Without a ``tolerance`` it is the reference; with one the absolute tolerance is a thousandth of it.
    """
    plant = start([rig], speed, spools)
    held = HELD.get(rig.friction.law, np.inf)
    model = SecondModel(rig, plant.end_effector()[:, 0], plant.state[:, 0], held)
    options: dict[str, Any] = {} if tolerance is None else {"rtol": tolerance, "atol": 1e-3 * tolerance}
    positions, pressures, evaluations = [], [], 0
    for k in range(periods):
        evaluations += model.advance(*motion(k), period, method=method, **options)
        positions.append(model.state[:2, None].copy())
        pressures.append(model.pressures[:, None].copy())
    return Course(np.array(positions), np.array(pressures), np.array([True])), evaluations


def start(rigs: list[Parameters], speed: tuple[float, float], spools: tuple[float, ...] = SHUT) -> Plant:
    """A plant with a rig per lane, at mid stroke in balance at ``speed``, m/s of both pistons, with ``spools`` open."""
    plant, zero = Plant(rigs, len(rigs)), np.zeros((2, len(rigs)))
    plant.state = balanced_state(plant.lane_parameters, zero, zero + np.array(speed)[:, None])
    plant.state[list(SPOOLS)] = np.array(spools)[:, None]
    return plant


def errors(course: Course, reference: Course) -> tuple[Array, Array]:
    """Largest difference in position (m) and pressure (relative) over the marks, (N,) each; infinite where there is none."""
    position = np.linalg.norm(course.position - reference.position, axis=1).max(axis=0)
    pressure = np.abs(course.pressure / reference.pressure - 1).max(axis=(0, 1))
    lost = ~np.isfinite(position) | ~np.isfinite(pressure)
    return np.where(lost, np.inf, position), np.where(lost, np.inf, pressure)


def joined(courses: Iterable[Course]) -> Course:
    """Courses of one rig each, side by side as lanes."""
    each = list(courses)
    lanes = [np.concatenate([getattr(course, name) for course in each], axis=-1) for name in ("position", "pressure", "clear")]
    return Course(*lanes)


def measure(rigs: Mapping[str, Parameters], motions: Mapping[str, Motion]) -> dict[str, Any]:
    """Errors of every method and step on every rig and motion, observed orders, and adaptive methods on the first rig."""
    found: dict[str, Any] = {"rigs": list(rigs), "steps_s": list(STEPS), "motions": {}}
    found["present_step_s"] = dynamics.INTEGRATION_STEP
    first = next(iter(rigs.values()))
    for name, motion in motions.items():
        shipped = run_method(list(rigs.values()), motion, runge_kutta, dynamics.INTEGRATION_STEP)
        courses = [
            run_reference(rig, motion)[0] if clear else NOWHERE for rig, clear in zip(rigs.values(), shipped.clear, strict=True)
        ]
        reference = joined(courses)
        methods: dict[str, Any] = {}
        for method, advance in METHODS.items():
            pairs = [errors(run_method(list(rigs.values()), motion, advance, step), reference) for step in STEPS]
            methods[method] = {
                "position_m": [list(map(float, position)) for position, _ in pairs],
                "pressure_relative": [list(map(float, pressure)) for _, pressure in pairs],
            }
        found["motions"][name] = {
            "clear_of_stops": list(map(bool, shipped.clear)),
            "methods": methods,
            "adaptive": _adaptive(first, motion, courses[0]),
            "reference_itself": _reference_itself(first, motion, courses[0]),
        }
    found["smooth"] = observed_orders(rigs)
    found["laws"] = _friction_laws(first, motions)
    return found


def _friction_laws(rig: Parameters, motions: Mapping[str, Motion]) -> dict[str, Any]:
    """Error of the plant as it is on one rig with each friction law."""
    found: dict[str, Any] = {}
    for law in LAWS:
        changed, found[law] = rig.replace({"friction.law": law}), {}
        for name, motion in motions.items():
            course = run_method([changed], motion, runge_kutta, dynamics.INTEGRATION_STEP)
            position, pressure = errors(course, run_reference(changed, motion)[0] if course.clear[0] else NOWHERE)
            found[law][name] = {"position_m": float(position[0]), "pressure_relative": float(pressure[0])}
    return found


def _adaptive(rig: Parameters, motion: Motion, reference: Course) -> list[dict[str, Any]]:
    rows = []
    for method, tolerance in itertools.product(ADAPTIVE, TOLERANCES):
        course, evaluations = run_reference(rig, motion, method=method, tolerance=tolerance)
        position, pressure = errors(course, reference)
        rows.append(
            {
                "method": method,
                "tolerance": tolerance,
                "evaluations_per_ms": evaluations / (1e3 * PERIOD * PERIODS),
                "position_m": float(position[0]),
                "pressure_relative": float(pressure[0]),
            }
        )
    return rows


def _reference_itself(rig: Parameters, motion: Motion, reference: Course) -> dict[str, float]:
    """How far the reference moves when its tolerance becomes ten times as large: what its own error may be."""
    model = run_reference(rig, motion, tolerance=1e-10)[0]
    position, pressure = errors(model, reference)
    return {"position_m": float(position[0]), "pressure_relative": float(pressure[0])}


def observed_orders(rigs: Mapping[str, Parameters]) -> dict[str, Any]:
    """Orders of convergence where the motion is smooth: log2 of the error's fall when the step is halved.

    Per method and rig the median over ``SMOOTH_STEPS``. Spools begin where they are commanded, beyond the corner of the flow
    at the end of their overlap.
    """
    options: Any = {"speed": SMOOTH_SPEED, "period": SMOOTH_TIME, "periods": 1, "spools": tuple(smooth(0)[0])}
    reference = joined(run_reference(rig, smooth, **options)[0] for rig in rigs.values())
    orders = {}
    for method, advance in METHODS.items():
        position = np.array(
            [errors(run_method(list(rigs.values()), smooth, advance, step, **options), reference)[0] for step in SMOOTH_STEPS]
        )
        with np.errstate(invalid="ignore"):
            orders[method] = list(map(float, np.median(np.log2(position[:-1] / position[1:]), axis=0)))
    return {"steps_s": list(SMOOTH_STEPS), "seconds": SMOOTH_TIME, "orders": orders}
