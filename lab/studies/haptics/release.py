"""A pull that is let go: how far the end effector flies past its target, how fast, and with how much energy."""

import itertools
from typing import Any

import numpy as np

from baselines.impedance import declared_by
from baselines.work.tasks import Result
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.haptics.own_error import declared_offset
from lab.studies.haptics.recording import Recording, record
from lab.studies.haptics.worlds import condition_of, lost_lanes, resting
from lab.studies.stability.rig_port import Hand

PULL, STIFFNESS = 190.0, 4000.0
"""N, within the 150-200 N of a forceps pull, and N/m, the setpoint of ``BirthSIM/Forceps``."""

PLACES = ((0.5, 0.0), (0.45, 0.05))
"""m: from there 48 mm along x are within the strokes."""

RISE, HELD, LET_GO = 2.0, 1.5, 0.010
"""s: at 95 N/s, within 45-100 N/s; time at full force, assumed; the hand lets go."""

AFTER = 2.5
"""s that are watched after that."""

FREE = RISE + HELD + LET_GO
"""s, when the hand is gone."""

SHOWN_FROM, SHOWN_TO, SHOWN_EVERY = -0.1, 0.9, 4
"""s about ``FREE`` and periods between, of what a figure shows."""


def pulling_hand(size: float) -> Hand:
    """A hand that pulls every lane along x with ``size`` N, and lets go."""

    def hand(now: float, position: Array, velocity: Array) -> Array:
        pull = np.zeros_like(position)
        pull[0] = size * max(0.0, min(now / RISE, 1.0, (FREE - now) / LET_GO))
        return pull

    return hand


def flight(recording: Recording, target: Array, free: float = FREE) -> dict[str, Array]:
    """Of a recording with a target (2, N), m, after the hand is gone, at ``free``, s, (N,) each: ``overshoot``, m, the farthest
    point beyond the target, against the pull; ``speed``, m/s, the largest."""
    after = recording.part(free, float(recording.time[-1]) + 1.0)
    beyond = target[0] - after.position[:, 0]
    return {
        "overshoot": np.maximum(beyond.max(axis=0), 0.0), "speed": np.sqrt((after.velocity**2).sum(axis=1)).max(axis=0)
    }  # fmt: skip


def measure_release(**settings: Any) -> Result:
    """Per lane, which are places and rigs; ``ideal`` is what the declared impedance does under the same force."""
    condition = condition_of(**settings)
    law = condition.law()
    places, rigs = (list(side) for side in zip(*itertools.product(PLACES, condition.drawn()), strict=True))
    reference = resting(places, [STIFFNESS] * len(rigs))
    declared, port = declared_by(law, reference), condition.port(law, rigs, reference)
    recording = record(port, pulling_hand(PULL), FREE + AFTER)
    found, lost = flight(recording, reference.position), lost_lanes(port, rigs)
    shown = slice(round((FREE + SHOWN_FROM) / port.period), round((FREE + SHOWN_TO) / port.period), SHOWN_EVERY)
    offset = recording.position[:, 0] - reference.position[0]
    result: Result = {
        "pull": PULL, "stiffness": STIFFNESS, "stored": PULL**2 / STIFFNESS / 2, "lost": lost.tolist(),
        "overshoot_mm": (1e3 * found["overshoot"]).tolist(), "speed": found["speed"].tolist(),
        "kinetic": (0.5 * np.array([rig.mechanics.mass for rig in rigs]) * found["speed"] ** 2).tolist(),
        "energy": recording.energy.max(axis=0).tolist(), "given_back": np.ptp(
            recording.part(RISE + HELD, FREE + AFTER).energy, axis=0).tolist(),
        "time": (recording.time[shown] - FREE).tolist(), "offset_mm": (1e3 * offset[shown]).T.tolist(), "ideal": None,
    }  # fmt: skip
    if declared is not None:
        path = declared_offset(declared, recording.force, port.period)
        rate = np.gradient(path, port.period, axis=0)
        ideal = Recording(recording.time, path + reference.position, rate, recording.force, recording.energy)
        best = flight(ideal, reference.position)
        result["ideal"] = {
            "overshoot_mm": (1e3 * best["overshoot"]).tolist(), "speed": best["speed"].tolist(),
            "offset_mm": (1e3 * path[shown, 0]).T.tolist(),
        }  # fmt: skip
    return result
