"""Logs from what the commands write: recordings, evaluations, and the traces in an evaluation's pieces."""

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.measures import TRACE
from baselines.logs.log import Column, Event, Log, Series
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
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


def read_log(path: Path) -> Log:
    """The log of a file; ``ValueError`` that names it and what is wrong."""
    if path.suffix == SUFFIX:
        return _recording(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        read: Callable[[Any], Log] = _piece if "result" in content else _evaluation
        return read(content)
    except OSError as error:
        raise ValueError(f"file = {str(path)!r} cannot be read: {error.strerror or error}") from error
    except Exception as error:
        # Damage trips json, NumPy and dictionaries in a dozen ways.
        problem = f"{type(error).__name__}: {error}".splitlines()[0]
        raise ValueError(
            f"file = {str(path)!r} is damaged or foreign ({problem}); allowed: a recording of birthsim live ({SUFFIX}), "
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
            columns[name] = Column(result["units"][name], name.replace("_", " ") + " of the episode")
            values[name] = np.array(numbers, dtype=np.float64)
        for discount, numbers in result["returns"].items():
            columns[f"return_{discount}"] = Column("1", f"sum of rewards, discounted by {discount} per 10 ms")
            values[f"return_{discount}"] = np.array(numbers, dtype=np.float64)
        times = np.arange(len(values["seed"]), dtype=np.float64)
        if any(column.shape != times.shape for column in values.values()):
            raise ValueError(f"episodes of {result['controller']} are not as many in all columns")
        series.append(Series(f"/evaluation/{result['controller']}", times, values))
    if not series or any(one.values.keys() != columns.keys() for one in series):
        raise ValueError("no results, or controllers with other metrics than others")
    return Log(columns, series, [], {"rig": content["rig"], "arguments": content["arguments"]})


def _piece(content: Any) -> Log:
    """The tracking errors over time of a piece's episodes, one topic per seed."""
    settings, result = content["settings"], content["result"]
    trace = result["trace"]
    errors = np.frombuffer(base64.b64decode(trace["float32"]), dtype="<f4").reshape(trace["shape"]).astype(np.float64)
    rig = Parameters.from_dict(settings["world"].get("parameters", settings["rig"]))
    period = rig.electronics.control_period
    times: Array = max(1, round(TRACE / period)) * period * np.arange(len(errors), dtype=np.float64)
    columns = {f"error{end}": Column("m", f"tracking error{end.replace('_', ', ')}") for end in _PLANE}
    series = [
        Series(f"/error/{settings['controller']}/{seed}", times, dict(zip(columns, errors[:, k].T.copy(), strict=True)))
        for k, seed in enumerate(result["seeds"])
    ]
    return Log(columns, series, [], {"rig": rig.to_dict(), "environment": settings["environment"]})
