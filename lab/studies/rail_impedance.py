"""Stiffness and damping that controllers render on a rail, on drawn benches with an encoder."""

import math
from typing import Any, cast

import numpy as np

from baselines.bench.pieces import controller_settings, file_stem
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.controller import Controller
from baselines.impedance import declared_by
from baselines.named import controlling_names, make_controller
from baselines.staged import StagedController
from baselines.work.tasks import Result, Task
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.topology import RAIL
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.information import Row
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, Cell, Head, markdown
from lab.engine.worlds import worlds
from lab.studies.haptics.worlds import Condition, lost_lanes, resting
from lab.studies.sensorless.privileged import Privileged
from lab.studies.stability.rig_port import RigPort

SENSORS = "encoders"

TILT = 30.0
"""Degrees; assumed: weight along the rail and across it."""

SETPOINTS = (1000.0, 1500.0, 2500.0)
"""N/m, of the worlds in turn; backstepping that is told the lightest bench with the slowest valves takes some 2770 N/m."""

PUSH, BEGINS, RISE, HELD, JUDGED = 20.0, 2.0, 1.0, 3.0, 0.5
"""N outward along the rail, whole after a rise, s, held for so long; the last s before it and of it are judged. Assumed."""

SWING, FREQUENCY, SETTLES, PERIODS = 20.0, 1.0, 2.0, 4
"""N to and fro, Hz, after s that do not count, and how many of its periods do. Assumed."""

OTHER = "abry[damping_ratio=1.4]"
"""Twice the damping that it asks for by itself."""

MORE_ROWS = (
    Row(OTHER),
    Row("abry", information.TOLD),
    Row(OTHER, information.TOLD),
    Row("abry-one-valve", information.TOLD),
    Row("backstepping-weight", information.TOLD),
    Row("backstepping-frozen", information.TOLD),
    Row("admittance-backstepping", information.TOLD),
    Row("admittance-sensorless", information.TOLD),
)
"""Beside each controller as it comes: another damping asked for, and what it does to be told the bench."""

UNITS = {"stiffness": "%", "damping": "%"}


def rows() -> list[Row]:
    """What is compared."""
    return [*(Row(name) for name in controlling_names()), *MORE_ROWS]


def rail() -> Parameters:
    """The bench that controllers believe in where they are not told theirs."""
    return Parameters().replace({"linkage.kind": RAIL, "linkage.inclination": math.radians(TILT)})


def direction() -> Array:
    """Of the rail, (2, 1)."""
    return np.array([[math.cos(math.radians(TILT))], [math.sin(math.radians(TILT))]])


def course(port: RigPort, push: Any, seconds: float) -> Array:
    """Way along the rail, m, (periods, N), while ``push(time)``, N, acts outward."""
    along, gone = direction(), []
    for _ in range(round(seconds / port.period)):
        port.advance(lambda now, position, velocity: along * push(now) * np.ones(port.lanes))
        gone.append((along * port.motion()[:2]).sum(axis=0))
    return np.array(gone)


def stiffness_felt(port: RigPort) -> Array:
    """N/m, (N,), of a push that is held: force over the way from where the carriage rested."""
    gone = course(port, lambda now: PUSH * min(max(now - BEGINS, 0.0) / RISE, 1.0), BEGINS + RISE + HELD)
    judged, begins = round(JUDGED / port.period), round(BEGINS / port.period)
    way = gone[-judged:].mean(axis=0) - gone[begins - judged : begins].mean(axis=0)
    return np.asarray(np.divide(PUSH, way, out=np.full(port.lanes, np.inf), where=way > 0.0))


def damping_felt(port: RigPort) -> Array:
    """N s/m, (N,), of a sine: the part of force over way that is ahead by a quarter of a period, over its angular frequency."""
    rate = 2 * np.pi * FREQUENCY
    gone = course(port, lambda now: SWING * math.sin(rate * now), SETTLES + PERIODS / FREQUENCY)
    count = round(PERIODS / FREQUENCY / port.period)
    times = port.period * (len(gone) - count + 1 + np.arange(count))[:, None]
    way = 2j * np.mean(gone[-count:] * np.exp(-1j * rate * times), axis=0)
    return np.asarray((SWING / way).imag / rate)


def damping_declared(law: Controller, port: RigPort, asked: Any) -> Array:
    """N s/m, (N,), of a slow push along the rail; not a number for a law that declares nothing."""
    said = declared_by(law, asked)
    if said is None:
        return np.full(port.lanes, np.nan)
    return np.asarray(np.einsum("ia,ijn,ja->n", direction(), said.damping, direction()))


def measure(controller: str, source: str, rig: dict[str, Any], told: bool, seed: int, lanes: int) -> Result:
    """Of worlds with the seeds ``seed`` on, lists over them by names of ``UNITS``, and which were lost.

    ``source`` only tells controllers of different files apart.
    """
    condition = Condition(controller, Parameters.from_dict(rig), SENSORS, seed, lanes, force_sensor=True)
    rigs, place = condition.drawn(), (condition.rig.geometry.k2 * direction()[:, 0]).tolist()
    setpoints = [SETPOINTS[k % len(SETPOINTS)] for k in range(lanes)]
    asked = resting([place] * lanes, setpoints)
    lost, found = np.zeros(lanes, dtype=np.bool_), {}
    for name in UNITS:
        law = condition.law()
        if told:
            law = Privileged([cast(StagedController, make_controller(controller, one)) for one in rigs])
        port = condition.port(law, rigs, asked)
        felt = stiffness_felt(port) if name == "stiffness" else damping_felt(port)
        wanted = np.array(setpoints) if name == "stiffness" else damping_declared(law, port, asked)
        found[name] = (100.0 * np.abs(felt / wanted - 1.0)).tolist()
        lost |= lost_lanes(port, rigs)
    return {**found, "lost": lost.tolist()}


def _tasks(options: Options) -> dict[Any, Task]:
    found = {}
    for row in rows():
        own = controller_settings(row.controller, rail())
        more = {"told": row.rig == information.TOLD, "seed": options.seed, "lanes": options.episodes}
        found[row] = Task(f"{file_stem(row.controller)}-{row.rig}", measure, {**own, **more})
    return found


def _kept(options: Options, found: Found) -> Any:
    figures = []
    for row, result in found.items():
        one = {**row._asdict(), "lost": sum(result["lost"])}
        for name in UNITS:
            values = penalize_lost(np.array(result[name], dtype=np.float64), np.array(result["lost"]))
            one[name] = None if np.isnan(values).all() else [quantile(values, share) for share in (0.5, 0.95)]
        figures.append(one)
    return jsonable(figures)


def _shown(content: Content) -> dict[str, str]:
    settings = content["settings"]
    off = Head("stiffness off, %", SPREAD), Head("damping off, %", SPREAD)
    whole: list[list[Cell | Head]] = [["controller", *information.COLUMNS, *off, "lost"]]
    for one in content["figures"]:
        row = Row(one["controller"], one["rig"], one["file"])
        felt = ["-" if one[name] is None else one[name] for name in UNITS]
        whole.append([f"`{row.controller}`", *row.facts(SENSORS), *felt, str(one["lost"])])
    asked = ", ".join(f"{setpoint:g}" for setpoint in SETPOINTS)
    said = (
        f"{worlds(settings['seed'], settings['episodes'])}, {SENSORS}, benches drawn, a rail at {TILT:g} degrees, setpoints of "
        f"{asked} N/m in turn. 95 % is the 95th percentile. *Stiffness off*: {PUSH:g} N over the way that they make in "
        f"{HELD:g} s, from the setpoint. *Damping off*: of {SWING:g} N to and fro at {FREQUENCY:g} Hz, from what the "
        f"controller declares; a law with integral action alone declares nothing. {information.LEGEND}"
    )
    return {"rail-impedance.md": f"{said}\n\n{markdown(whole)}\n"}


STUDY = Study(
    {"episodes": 64, "seed": 775_000},
    _tasks,
    _kept,
    UNITS,
    _shown,
    words={"episodes": "benches that are drawn"},
)
register(study="rail-impedance", about="stiffness and damping that controllers render on a rail")(STUDY)
