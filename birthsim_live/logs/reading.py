"""Logs from what the commands write: recordings, evaluations, and the traces in an evaluation's pieces."""

import base64
import math
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.measures import TRACE
from baselines.logs.log import Column, Event, Log, Series
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.schema import Each, Listed, fault
from birthsim_env.physics.rig.values import shown
from birthsim_live.logs.recording import EVENTS, SLICES, SUFFIX, load_recording

_PLANE, _CYLINDERS, _CHAMBERS = ("_x", "_y"), ("_1", "_2"), ("_P1", "_N1", "_P2", "_N2")
FIELDS = {
    "time": ("s", "time since the last reset", ("",)),
    "episode_time": ("s", "time since the episode began", ("",)),
    "joints": ("m", "position of the piston", _CYLINDERS),
    "position": ("m", "position of the end effector", _PLANE),
    "velocity": ("m/s", "velocity of the end effector", _PLANE),
    "target": ("m", "target position of the end effector", _PLANE),
    "compliant": ("m", "target displaced by the hand's force over the stiffness setpoint", _PLANE),
    "scenario_force": ("N", "force of the scenario's hand", _PLANE),
    "drag_force": ("N", "force of the person who drags the end effector", _PLANE),
    "pointer": ("m", "where the person's pointer is, if it holds the end effector", _PLANE),
    "pressures": ("Pa", "absolute pressure of the chamber", _CHAMBERS),
    "openings": ("1", "opening of the chamber's spool, -1 to 1", _CHAMBERS),
    "stiffness": ("N/m", "setpoint of the Cartesian stiffness", _PLANE),
    "pneumatic": ("N/m", "pneumatic stiffness of the cylinder", _CYLINDERS),
    "pneumatic_setpoint": ("N/m", "setpoint of the pneumatic stiffness", _CYLINDERS),
    "friction": ("N", "friction on the piston, positive where it holds back a motion outwards", _CYLINDERS),
    "flows": ("kg/s", "air that flows into the chamber, out of it where negative", _CHAMBERS),
}
"""Field of a recording -> unit, meaning, and what its columns' names end with."""


_NUMBERS = Listed((float, None))
_EVALUATION = {
    "rig": dict,
    "arguments": dict,
    "results": Listed({
        "controller": str, "seeds": Listed(range(-(2**63), 2**63), 1), "lost": Listed(bool), "success": Listed(bool),
        "required_strength_ratio": _NUMBERS, "units": Each(str), "episodes": Each(_NUMBERS), "returns": Each(_NUMBERS),
    }, 1),
}  # fmt: skip
_PIECE = {
    "settings": {"controller": str, "environment": str, "rig": dict, "world": {"parameters?": dict}},
    "result": {"seeds": Listed(int, 1), "trace": {"float32": str, "shape": Listed(range(1, 2**31))}},
}
"""What files hold of what is read here."""

MOST = 2**28
"""Bytes of a JSON file."""


def read_log(path: Path) -> Log:
    """The log of a file; ``ValueError`` that names it and what is wrong."""
    if path.suffix == SUFFIX:
        return _recording(path)
    content = read_json("file", path, dict, MOST)
    read, schema = (_piece, _PIECE) if "result" in content else (_evaluation, _EVALUATION)
    try:
        if problem := fault(content, schema):
            raise ValueError(problem)
        return read(content)
    except ValueError as error:
        raise ValueError(
            f"file = {named(path)} is damaged or foreign: {error}; allowed: a recording of birthsim live ({SUFFIX}), "
            "evaluation.json of birthsim evaluate, or a piece of one, which holds traces"
        ) from error


def _recording(path: Path) -> Log:
    recording = load_recording(path)
    columns = {
        name + end: Column(unit, meaning + end.replace("_", ", "))
        for name, (unit, meaning, ends) in FIELDS.items()
        for end in ends
    }
    times: Array = recording.interval * np.arange(len(recording.rows), dtype=np.float64)
    series = [_rig("/rig", times, recording.rows)]
    there = np.isfinite(recording.second[:, SLICES["time"]][:, 0])
    if there.any():
        series.append(_rig("/second_rig", times[there], recording.second[there]))
    events = [
        Event(float(times[event["row"]]), kind, event[kind]) for event in recording.events for kind in EVENTS if kind in event
    ]
    about = {"rig": recording.rig.to_dict(), "interval": recording.interval}
    return Log(columns, series, events, about)


def _rig(topic: str, times: Array, rows: Array) -> Series:
    values = {}
    for name, (_, _, ends) in FIELDS.items():
        for end, column in zip(ends, rows[:, SLICES[name]].T, strict=True):
            values[name + end] = np.ascontiguousarray(column)
    return Series(topic, times, values)


def _evaluation(content: Any) -> Log:
    """A row per episode; its time is its number in s, which programs that plot over time need."""
    columns = {
        "seed": Column("1", "seed of the episode"),
        "lost": Column("1", "whether the episode was lost"),
        "success": Column("1", "whether it ended in success"),
        "required_strength_ratio": Column("1", "fraction of the rig's strength that the episode asks for"),
    }
    series = []
    for result in content["results"]:
        values = {
            "seed": np.array(result["seeds"], dtype=np.int64),
            "lost": np.array(result["lost"], dtype=np.bool_),
            "success": np.array(result["success"], dtype=np.bool_),
            "required_strength_ratio": np.array(result["required_strength_ratio"], dtype=np.float64),
        }
        for name, numbers in result["episodes"].items():
            if name not in result["units"]:
                raise ValueError(f"{shown(name)} has no unit; allowed: units of all metrics")
            columns[name] = Column(result["units"][name], name.replace("_", " ") + " of the episode")
            values[name] = np.array(numbers, dtype=np.float64)
        for discount, numbers in result["returns"].items():
            columns[f"return_{discount}"] = Column("1", f"sum of rewards, discounted by {discount} per 10 ms")
            values[f"return_{discount}"] = np.array(numbers, dtype=np.float64)
        times = np.arange(len(values["seed"]), dtype=np.float64)
        if any(column.shape != times.shape for column in values.values()):
            raise ValueError(f"episodes of {shown(result['controller'])} are not as many in all columns")
        series.append(Series(f"/evaluation/{result['controller']}", times, values))
    if any(one.values.keys() != columns.keys() for one in series):
        raise ValueError("controllers with other metrics than others")
    return Log(columns, series, [], {"rig": content["rig"], "arguments": content["arguments"]})


def _piece(content: Any) -> Log:
    """The tracking errors over time of a piece's episodes, one topic per seed."""
    settings, result = content["settings"], content["result"]
    trace = result["trace"]
    errors = np.frombuffer(base64.b64decode(trace["float32"]), dtype="<f4")
    if trace["shape"][1:] != [len(result["seeds"]), 2] or math.prod(trace["shape"]) != errors.size:
        raise ValueError(f"a trace of shape {shown(trace['shape'])}; allowed: times, seeds, x and y")
    errors = errors.reshape(trace["shape"]).astype(np.float64)
    rig = Parameters.from_dict(settings["world"].get("parameters", settings["rig"]))
    period = rig.electronics.control_period
    times: Array = max(1, round(TRACE / period)) * period * np.arange(len(errors), dtype=np.float64)
    columns = {f"error{end}": Column("m", f"tracking error{end.replace('_', ', ')}") for end in _PLANE}
    series = [
        Series(f"/error/{settings['controller']}/{seed}", times, dict(zip(columns, errors[:, k].T.copy(), strict=True)))
        for k, seed in enumerate(result["seeds"])
    ]
    return Log(columns, series, [], {"rig": rig.to_dict(), "environment": settings["environment"]})
