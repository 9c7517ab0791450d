"""Up to which frequency a hand feels the impedance declared, push by push (``stimuli``), and up to which valves allow it."""

from typing import Any

import numpy as np

from baselines.bench.pieces import controller_settings, file_stem
from baselines.bench.probes import board_limit
from baselines.bench.resting import RestingRigs
from baselines.bench.statistics import crossed_interval, quantile
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
from lab.engine.tables import Cell, Head, digits, markdown
from lab.studies.bandwidth.stimuli import KINDS, Multisine, stimuli, words_of
from lab.studies.bandwidth.valves import commanded_openings
from lab.studies.haptics.impedance import bandwidth, last_before, unnoticed_up_to
from lab.studies.haptics.multisine import FADE, sines
from lab.studies.haptics.worlds import DIRECTIONS, POSES, Condition, condition_of, resting
from lab.studies.sensorless.own_logs import Informed

STIFFNESS = 2000.0
"""N/m."""

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

CLOSELY = (
    ("admittance-adaptive", "honest"), ("admittance-adaptive", "honest, acceleration"), ("admittance-adaptive", KNOWN),
    ("admittance-sensorless", "honest, acceleration"), ("admittance-sensorless", KNOWN),
)  # fmt: skip
"""Of ``MEASURED`` those that slow lines and lone sines push too."""

MEASURED = (
    ("backstepping", "honest"), ("admittance-adaptive", "ideal"), ("admittance-adaptive", "honest"),
    ("admittance-adaptive", "honest, acceleration"), ("admittance-adaptive", KNOWN),
    ("admittance-sensorless", "honest, acceleration"), ("admittance-sensorless", KNOWN),
)  # fmt: skip
"""Controllers, and the sensors of ``RIGS`` that they have."""

SAID = (
    "A bandwidth belongs to its push. *Lines* are sines at once: of a multisine those below 1 Hz, and after these those from 1 "
    "to 20 Hz, 20 a decade. A *lone sine* is one at a time. Medians and worst are over the rigs."
)
"""Above the table."""

COLUMNS = [
    *("controller", "sensors", "push", "axis"),
    *(f"{name}{part}" for name in ("bandwidth", "unnoticed", "allowed") for part in ("", "_low", "_high", "_worst")), "lost",
]  # fmt: skip
"""Of the figures; those of frequencies in Hz."""


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


def measure(push: str, size: float, known: bool, **settings: Any) -> Result:
    """Bandwidth, and up to where 1 JND holds, Hz, under a ``push`` of ``KINDS`` of a ``size``, N: over directions and rigs,
    (2, R) each. ``known``: the controller is told each rig that is drawn.
    """
    pushes = KINDS[push](size, settings["seed"]).pushes
    condition = condition_of(**settings)
    rigs, direction, reference = _cases(condition)
    if known:
        condition = Informed(**vars(condition), told=rigs)
    declared = declared_by(condition.law(), reference)
    if declared is None:
        raise ValueError(f"controller = {condition.controller!r}; allowed: one that declares an impedance")
    frequency = np.concatenate([one.frequency for one in pushes])
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
    frequency, amplitudes, period, _ = Multisine(peak, condition.seed).pushes[-1]
    force, found = amplitudes[:, None], []
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


def _tasks(options: Options) -> dict[Any, Task]:
    found: dict[Any, Task] = {}
    for controller, sensors in MEASURED:
        settings = {**_settings(controller, sensors, options), "known": sensors == KNOWN}
        for kind in KINDS if (controller, sensors) in CLOSELY else ("peak",):
            for size in getattr(options, kind):
                name = f"{file_stem(controller)}/{file_stem(sensors)}-{kind}-{size:g}"
                push = KINDS[kind](size, options.seed).name
                found[controller, sensors, push] = Task(name, measure, {**settings, "push": kind, "size": size})
    for peak in options.peak:
        settings = {**_settings("admittance-adaptive", "ideal", options), "peak": peak}
        found[Multisine(peak, options.seed).name] = Task(f"allowed/{peak:g}", allowed, settings)
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
        for push in stimuli(options)
        if (controller, sensors, push) in found
        for way, axis in enumerate("xy")
    ]
    return {"columns": COLUMNS, "rows": rows}


def _entry(median: float, low: float, high: float, worst: float) -> list[str | float]:
    return [f"{digits(median)} [{digits(low)}, {digits(high)}]", worst]


def _shown(content: Content) -> dict[str, str]:
    statistics = ("median [95 % interval]", "worst")
    heads = [Head(quantity, statistics) for quantity in ("bandwidth, Hz", "1 JND up to, Hz", "valves allow, Hz")]
    head: list[Cell | Head] = ["controller", *information.COLUMNS, "sensors", "axis", *heads, "lost"]
    of = dict[str, list[list[Cell | Head]]]()
    for row in content["figures"]["rows"]:
        cells = ["-" if row[first] is None else _entry(*row[first : first + 4]) for first in (4, 8, 12)]
        model, file = RIGS[row[1]]
        rig = information.TOLD if row[1] == KNOWN else information.DEFAULT
        facts = information.informed(row[0], model, rig=rig, parameters=file or "")
        of.setdefault(row[2], []).append([f"`{row[0]}`", *facts, row[1], row[3], *cells, str(row[-1])])
    parts = [f"{SAID} {information.LEGEND}"]
    for push, rows in of.items():
        alike = [tuple(map(str, (row[1], *row[3:6]))) for row in rows]
        parts += [f"## {words_of(push, content['settings']['seed'])}", markdown([head, *rows], most=heads[:2], alike=alike)]
    return {"bandwidth.md": "\n\n".join(parts) + "\n"}


STUDY = Study(
    {"peak": (2.0, 10.0, 20.0), "slow": (4.9,), "sine": (5.0, 20.0), "rigs": 36, "seed": 7_300_000},
    _tasks,
    _kept,
    {"bandwidth": "Hz", "unnoticed": "Hz", "allowed": "Hz"},
    _shown,
    words={
        "peak": "N that multisines of the hand reach",
        "slow": "N of each of its slow lines",
        "sine": "N of its lone sines",
        "rigs": "randomised ones",
    },
)
register(study="bandwidth", about="up to which frequency a hand feels what is declared")(STUDY)
