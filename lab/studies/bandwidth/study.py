"""Up to which frequency a hand feels the impedance declared, on a dense grid, and up to which one the valves allow it."""

from typing import Any

import numpy as np

from baselines.bench.pieces import controller_settings, file_stem
from baselines.bench.probes import board_limit
from baselines.bench.resting import RestingRigs
from baselines.bench.statistics import crossed_interval, number, quantile
from baselines.estimation.admittance import DAMPING_RATIO
from baselines.impedance import Complex, declared_by, mass_spring_damper
from baselines.work.tasks import Result, Task
from birthsim_env.loop.signals import Mask, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import markdown
from lab.studies.bandwidth.valves import commanded_openings
from lab.studies.haptics.impedance import bandwidth, last_before, unnoticed_up_to
from lab.studies.haptics.multisine import FADE, sines, unit_multisine
from lab.studies.haptics.worlds import DIRECTIONS, POSES, Condition, condition_of, resting
from lab.studies.sensorless.own_logs import Informed

STIFFNESS = 2000.0
"""N/m."""

BANDS = ((0.1, 0.95, 80.0, 1), (1.0, 20.0, 20.0, 2))
"""Hz from and to; s of a period, and periods that are measured. Two multisines, so that a line has a force worth feeling."""

SINE, SINE_STEP, SINE_TIME = 20.0, 2, 2.0
"""N of a hand that pushes with one sine at a time, which lines of the grid it takes, and s that it is measured at least, over
two periods or more."""

SETTLING = 5.0
"""s before the measured periods; assumed."""

CHUNK = 1000
"""Control periods whose positions are kept at once."""

ACCELERATION = "examples/acceleration_sensor_rig.toml"
KNOWN = "honest, acceleration, rig known"
RIGS = {
    "ideal": ("ideal", None), "honest": ("honest", None), "honest, acceleration": ("honest", ACCELERATION),
    KNOWN: ("honest", ACCELERATION),
}  # fmt: skip
"""Sensors by their name in the table -> sensor model, and the file of the rig that controllers believe. With ``KNOWN`` they are
told each rig that is drawn, as after ``birthsim identify``."""

WITH_SINES = (
    ("admittance-adaptive", KNOWN),
    ("admittance-sensorless", "honest, acceleration"),
    ("admittance-sensorless", KNOWN),
)
"""Of ``MEASURED`` those that are also felt with one sine at a time."""

MEASURED = (
    ("backstepping", "honest"), ("admittance-adaptive", "ideal"), ("admittance-adaptive", "honest"),
    ("admittance-adaptive", "honest, acceleration"), ("admittance-adaptive", KNOWN),
    ("admittance-sensorless", "honest, acceleration"), ("admittance-sensorless", KNOWN),
)  # fmt: skip
"""Controllers, and the sensors of ``RIGS`` that they have."""

COLUMNS = [
    *("controller", "sensors", "push", "axis"),
    *(f"{name}{part}" for name in ("bandwidth", "unnoticed", "allowed") for part in ("", "_low", "_high", "_worst")), "lost",
]  # fmt: skip
"""Of the figures; those of frequencies in Hz."""


def lines(low: float, high: float, period: float) -> Array:
    """Frequencies (F,), Hz: 20 a decade (ISO 3, R 20), to the nearest whole multiple of 1/``period``."""
    steps = np.arange(np.floor(20 * np.log10(low)), np.ceil(20 * np.log10(high)) + 1)
    exact = 10 ** (steps / 20)
    kept = exact[(exact > 0.99 * low) & (exact < 1.01 * high)]
    return np.asarray(np.unique(np.round(kept * period)) / period)


def hand_lines(peak: float, seed: int, frequency: Array, period: float) -> Complex:
    """Complex amplitudes (F,), N, of a multisine with a peak of ``peak``, N: the force is the real part of their sum."""
    size, phases = unit_multisine(seed, frequency, period)
    return np.asarray(peak * size * np.exp(1j * (phases - np.pi / 2)))


def felt_impedance(
    condition: Condition,
    rigs: list[Parameters],
    reference: Reference,
    direction: Array,
    frequency: Array,
    force: Complex,
    period: float,
    periods: int,
) -> tuple[Complex, Mask]:
    """Z = Fu/(x - xt), N/m, (F, N), of lanes with ``rigs`` at a resting ``reference``, and which of them were lost, (N,).

    The hand pushes along ``direction`` (2, N) with the lines ``force`` (F,), N, of ``frequency`` (F,), Hz, which repeat after
    ``period``, s; ``periods`` of them are measured.
    """
    loop = RestingRigs(rigs, reference, condition.law(), condition.sensors, condition.seed, condition.force_sensor)
    settling, count = round(SETTLING / loop.period), round(periods * period / loop.period)
    # The hand's force is held for a control period: at what it is half a period later, once it has been measured.
    time = 0.5 * loop.period * np.arange(2 * (settling + count), dtype=np.float64)
    pushes = np.abs(force[0]) * sines(time, frequency, np.asarray(np.angle(force) + np.pi / 2)) * np.minimum(time / FADE, 1.0)
    now = iter(pushes)

    def push(_: int) -> None:
        loop.pushed[:] = direction * next(now)

    loop.close([push], [push])
    loop.run(settling)
    moved = np.zeros((len(frequency), len(rigs)), dtype=np.complex128)
    for first in range(0, count, CHUNK):
        offset = loop.path(min(CHUNK, count - first)) - reference.position
        turns = np.exp(-2j * np.pi * frequency[:, None] * loop.period * (settling + first + np.arange(len(offset))))
        moved += 2 / count * turns @ np.einsum("tin,in->tn", offset, direction)
    lost = ~np.isfinite(moved).all(axis=0) | (loop.impacts.max(axis=0) > board_limit(rigs))
    return np.asarray(force[:, None] / moved), np.asarray(lost)


def _cases(condition: Condition) -> tuple[list[Parameters], Array, Reference]:
    """Lanes: each of a condition's rigs, at one of ``POSES`` in turn, pushed along x and along y."""
    rigs = condition.drawn()
    cases = [(rig, way, POSES[k % len(POSES)]) for way in DIRECTIONS for k, rig in enumerate(rigs)]
    each, directions, poses = (list(side) for side in zip(*cases, strict=True))
    return each, np.transpose(directions), resting(poses, [STIFFNESS] * len(cases))


def measure(peak: float, known: bool, **settings: Any) -> Result:
    """Bandwidth, and up to where 1 JND holds, Hz, under pushes of ``peak`` N at most: over directions and rigs, (2, R) each.

    ``known``: the controller is told each rig that is drawn.
    """
    pushes = []
    for low, high, period, periods in BANDS:
        own = lines(low, high, period)
        pushes.append((own, hand_lines(peak, settings["seed"], own, period), period, periods))
    return _measured_with(pushes, known, settings)


def measure_sines(size: float, known: bool, **settings: Any) -> Result:
    """The same under one sine of ``size`` N at a time."""
    every = np.concatenate([lines(low, high, period) for low, high, period, _ in BANDS])[::SINE_STEP]
    pushes = [(own, np.array([-1j * size]), 1 / own[0], max(2, round(SINE_TIME * own[0]))) for own in every[:, None]]
    return _measured_with(pushes, known, settings)


def _measured_with(pushes: list[tuple[Array, Complex, float, int]], known: bool, settings: dict[str, Any]) -> Result:
    """What is felt under one push after another: its frequencies, amplitudes, period, and how many periods are measured."""
    condition = condition_of(**settings)
    rigs, direction, reference = _cases(condition)
    if known:
        condition = Informed(**vars(condition), told=rigs)
    declared = declared_by(condition.law(), reference)
    if declared is None:
        raise ValueError(f"controller = {condition.controller!r}; allowed: one that declares an impedance")
    frequency = np.concatenate([own for own, *_ in pushes])
    felt, lost = [], np.zeros(len(rigs), dtype=np.bool_)
    for own, force, period, periods in pushes:
        found, gone = felt_impedance(condition, rigs, reference, direction, own, force, period, periods)
        felt.append(found)
        lost |= gone
    impedances = np.concatenate(felt), declared.along(frequency, direction), frequency
    figures = {"bandwidth": bandwidth(*impedances), "unnoticed": unnoticed_up_to(*impedances)}
    kept = {name: np.where(lost, 0.0, values).reshape(len(DIRECTIONS), -1).tolist() for name, values in figures.items()}
    return {**kept, "lost": int(lost.sum())}


def allowed(peak: float, **settings: Any) -> Result:
    """The last line, Hz, up to which valves can render ``admittance``'s impedance exactly, over directions and rigs, (2, R)."""
    condition = condition_of(**settings)
    low, high, period, _ = BANDS[-1]
    frequency = lines(low, high, period)
    force, found = hand_lines(peak, condition.seed, frequency, period)[:, None], []
    for lane, rig in enumerate((cases := _cases(condition))[0]):
        direction, reference = cases[1][:, [lane]], Reference(cases[2].rows[:, [lane]])
        declared = mass_spring_damper(reference, condition.rig.mechanics.mass, DAMPING_RATIO)
        openings = commanded_openings(rig, reference, declared, direction, frequency, force, period)
        found.append(float(last_before(openings <= 1.0, frequency)[0]))
    return {"allowed": np.reshape(found, (len(DIRECTIONS), -1)).tolist()}


def _settings(controller: str, sensors: str, options: Options) -> dict[str, Any]:
    model, file = RIGS[sensors]
    own = controller_settings(controller, load_parameters(ROOT / file if file else None))
    return {**own, "sensors": model, "seed": options.seed, "rigs": options.rigs, "force_sensor": True}


def _pushes(options: Options) -> list[str]:
    """How the table calls what the hand does: multisines by their peak, and one sine at a time."""
    return [*(f"{peak:g} N" for peak in options.peak), f"one sine of {SINE:g} N"]


def _tasks(options: Options) -> dict[Any, Task]:
    found: dict[Any, Task] = {}
    *multisines, sine = _pushes(options)
    for controller, sensors in MEASURED:
        settings = {**_settings(controller, sensors, options), "known": sensors == KNOWN}
        stem = f"{file_stem(controller)}/{file_stem(sensors)}"
        for push, peak in zip(multisines, options.peak, strict=True):
            found[controller, sensors, push] = Task(f"{stem}-{peak:g}", measure, {**settings, "peak": peak})
        if (controller, sensors) in WITH_SINES:
            found[controller, sensors, sine] = Task(f"{stem}-sine", measure_sines, {**settings, "size": SINE})
    for push, peak in zip(multisines, options.peak, strict=True):
        found[push] = Task(f"allowed/{peak:g}", allowed, {**_settings("admittance-adaptive", "ideal", options), "peak": peak})
    return found


def _summary(values: Any) -> list[float]:
    """Median over rigs, its interval, and the worst."""
    low, high = crossed_interval(lambda drawn: quantile(drawn, 0.5), np.reshape(values, (-1, 1)))
    return [quantile(values, 0.5), low, high, float(np.min(values))]


def _kept(options: Options, found: Found) -> Any:
    rows = [
        [
            controller,
            sensors,
            push,
            axis,
            *_summary(found[controller, sensors, push]["bandwidth"][way]),
            *_summary(found[controller, sensors, push]["unnoticed"][way]),
            *(_summary(found[push]["allowed"][way]) if push in found else [None] * 4),
            found[controller, sensors, push]["lost"],
        ]
        for controller, sensors in MEASURED
        for push in _pushes(options)
        if (controller, sensors, push) in found
        for way, axis in enumerate("xy")
    ]
    return {"columns": COLUMNS, "rows": rows, "lines": [_line(options.seed, *band) for band in BANDS]}


def _line(seed: int, low: float, high: float, period: float, periods: int) -> list[float]:
    """Of a multisine with a peak of 1 N: how many sines it has, Hz from and to, and the size of each, N."""
    own = lines(low, high, period)
    return [len(own), own[0], own[-1], unit_multisine(seed, own, period)[0]]


def _shown(content: Content) -> dict[str, str]:
    head = ["sensors", "what the hand does", "axis", "bandwidth, Hz", "1 JND up to, Hz", "valves allow, Hz", "lost"]
    rows = [["controller", *information.COLUMNS, *head]]
    for row in content["figures"]["rows"]:
        cells = [
            "-" if row[first] is None else "{} [{}, {}]; {}".format(*map(number, row[first : first + 4]))
            for first in (4, 8, 12)
        ]
        push = row[2] if row[2].startswith("one") else f"multisines of {row[2]} at most"
        model, file = RIGS[row[1]]
        rig = information.TOLD if row[1] == KNOWN else information.DEFAULT
        facts = information.informed(row[0], model, rig=rig, parameters=file or "")
        rows.append([row[0], *facts, row[1], push, row[3], *cells, str(row[-1])])
    alike = [(row[1], *row[3:7]) for row in rows[1:]]
    return {"bandwidth.md": f"{_stimuli(content)} {information.LEGEND}\n\n{markdown(rows, most=rows[0][7:9], alike=alike)}\n"}


def _stimuli(content: Content) -> str:
    """What the multisines are made of, in a sentence."""
    parts, peaks = [], content["settings"]["peak"]
    for count, low, high, size in content["figures"]["lines"]:
        sizes = " or ".join(number(peak * size) for peak in peaks)
        parts.append(f"{count} sines at once from {low:g} to {high:g} Hz, each of {sizes} N")
    return f"A multisine of {' or '.join(f'{peak:g}' for peak in peaks)} N at most is {', and then '.join(parts)}."


STUDY = Study(
    {"peak": (2.0, 10.0, 20.0), "rigs": 36, "seed": 7_300_000},
    _tasks,
    _kept,
    {"bandwidth": "Hz", "unnoticed": "Hz", "allowed": "Hz"},
    _shown,
    words={"peak": "N that multisines of the hand reach", "rigs": "randomised ones"},
)
register(study="bandwidth", about="up to which frequency a hand feels what is declared")(STUDY)
