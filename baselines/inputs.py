"""What ``command`` of a controller is given: how many lanes, one rig without lanes, and checks of what comes besides."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from birthsim_env.loop import guard
from birthsim_env.loop.rows import signal_of
from birthsim_env.loop.signals import REFERENCES, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.arrays import shape_of


def one_lane(measurement: Measurement, reference: Reference) -> tuple[Measurement, Reference]:
    """Signals of one rig, which have no lane axis, as signals over one lane."""
    names = ("time", "position", "position_time", "velocity", "pressures", "user_force", "acceleration")
    signals = ((name, getattr(measurement, name)) for name in names)
    columns: dict[str, Any] = {
        name: signal_of(f"measurement.{name}", one)[..., None] for name, one in signals if one is not None
    }
    return replace(measurement, **columns), Reference(signal_of("reference.rows", reference.rows)[..., None])


COMMAND_OPTIONS = ("feedforward_force", "feedforward_rate", "damping_factor")
"""What ``command`` of a law may take besides the signals."""


_COUNTS = {"position": 2, "velocity": 2, "pressures": 4, "user_force": 2, "acceleration": 2}
"""Rows of the fields of a ``Measurement`` that have some."""


def lanes_of(measurement: Measurement, reference: Reference) -> int:
    """The number of lanes of both; ``ValueError`` for signals over different numbers of lanes."""
    shape = shape_of(measurement.position)
    if len(shape) != 2:
        raise ValueError(f"measurement.position has shape {shape}; allowed: (2, N), or (2,) for one rig")
    lanes = shape[1]
    for name, count in _COUNTS.items():
        signal = getattr(measurement, name)
        if (signal is not None or name != "acceleration") and shape_of(signal) != (count, lanes):
            raise _of_other_lanes(f"measurement.{name}", signal, count, lanes)
    if shape_of(reference.rows) != (REFERENCES, lanes):
        raise _of_other_lanes("reference.rows", reference.rows, REFERENCES, lanes)
    return lanes


def _of_other_lanes(name: str, signal: object, count: int, lanes: int) -> ValueError:
    allowed = f"allowed: {(count, lanes)}, with the lanes of measurement.position"
    return ValueError(f"{name} has shape {shape_of(signal)}; {allowed}")


def feedforward_rows(
    lanes: int, force: Array | None = None, rate: Array | None = None, factor: Array | None = None, *, taken: Sequence[str]
) -> Array:
    """What a law takes besides the signals, (5, lanes), zero where nothing: believed forces along cylinders 1 and 2, N, their
    rates, N/s, and a damping factor. ``ValueError`` for what has not that shape, is no number as large as what is asked for may
    be, and for what is not ``taken``."""
    most = guard.MOST["reference"]
    given = np.zeros((5, lanes))
    for name, rows, one in zip(COMMAND_OPTIONS, (given[:2], given[2:4], given[4]), (force, rate, factor), strict=True):
        if one is not None:
            if name not in taken:
                raise ValueError(f"{name} is given; allowed: {' and '.join(taken) or 'nothing'} besides the signals")
            if shape_of(one) != rows.shape:
                raise ValueError(
                    f"{name} has shape {shape_of(one)}; allowed: {rows.shape}, with the lanes of measurement.position"
                )
            rows[:] = signal_of(name, one)
            wrong = ~(np.abs(rows) <= most)
            if wrong.any():
                raise ValueError(f"{name} has {rows[wrong][0]:g}; allowed: finite numbers, at most {most:g}")
    return given
