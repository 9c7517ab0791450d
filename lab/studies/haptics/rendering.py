"""One piece of the bench: multisine hands at several poses and amplitudes, and all that they tell of the impedance felt."""

import itertools
from typing import Any

import numpy as np

from baselines.bench.metrics import NORMAL_DENSITY
from baselines.impedance import declared_by
from baselines.work.tasks import Result
from lab.studies.haptics.impedance import (
    WEBER,
    WEBER_WITHOUT_WORK,
    bandwidth,
    noticeable_differences,
    passivity_shortage,
    port_damping,
    unnoticed_up_to,
)
from lab.studies.haptics.multisine import (
    FREQUENCIES,
    FUNDAMENTAL,
    SECONDS,
    SETTLING,
    impedance_felt,
    measured_part,
    multisine_hand,
)
from lab.studies.haptics.own_error import declared_offset, error_size, pure_spring_offset
from lab.studies.haptics.recording import record
from lab.studies.haptics.worlds import DIRECTIONS, POSES, Condition, condition_of, lost_lanes, resting

STIFFNESSES = (1000.0, 2000.0, 4000.0)
"""N/m."""

PEAKS = (5.0, 10.0, 20.0)
"""N, of the hand's force."""

SHOWN_EVERY = 50
"""Periods between the energies that a figure shows, the largest of all lanes with one peak."""


def measure_rendering(stiffness: float, **settings: Any) -> Result:
    """``rendering`` from the settings of a piece."""
    return rendering(condition_of(**settings), stiffness)


def rendering(condition: Condition, stiffness: float) -> Result:
    """Per lane (pose, direction, peak, rig) the metrics of docs/laboratory/haptics.md; SI units, except mm and l/min."""
    law, each = condition.law(), condition.drawn()
    cases = list(itertools.product(POSES, DIRECTIONS, PEAKS, each))
    poses, directions, peaks, rigs = (list(side) for side in zip(*cases, strict=True))
    reference, direction, peak = resting(poses, [stiffness] * len(cases)), np.transpose(directions), np.array(peaks)
    declared = declared_by(law, reference)
    port = condition.port(law, rigs, reference)
    recording = record(port, multisine_hand(direction, peak, condition.seed), SECONDS)
    felt, lost = impedance_felt(recording, direction), lost_lanes(port, rigs)
    shown = recording.energy[::SHOWN_EVERY]
    begin, end = SETTLING / FUNDAMENTAL, SECONDS
    spring = error_size(recording, reference, pure_spring_offset(reference, recording.force), begin, end)
    found: Result = {
        "stiffness": stiffness, "frequency": FREQUENCIES, "peak": peak, "lost": lost, "pose": poses, "direction": directions,
        "felt": [felt.real, felt.imag], "port_damping": port_damping(felt, FREQUENCIES),
        "shortage": passivity_shortage(felt, FREQUENCIES), "error_spring_mm": 1e3 * spring,
        "motion_mm": 1e3 * np.ptp(measured_part(recording).position, axis=0).max(axis=0),
        "energy": recording.energy.max(axis=0), "energy_over_time": [shown[:, peak == one].max(axis=1) for one in PEAKS],
        "energy_period": SHOWN_EVERY * port.period, "air": 60e3 * port.air / NORMAL_DENSITY / SECONDS,
        "saturation": 100 * port.saturated * port.period / SECONDS, "declared": None,
    }  # fmt: skip
    if declared is not None:
        own = declared_offset(declared, recording.force, port.period)
        wanted = declared.along(FREQUENCIES, direction)
        found |= {
            "declared": [wanted.real, wanted.imag],
            "bandwidth": bandwidth(felt, wanted, FREQUENCIES),
            "differences": noticeable_differences(felt, wanted, WEBER),
            "unnoticed": unnoticed_up_to(felt, wanted, FREQUENCIES, WEBER),
            "unnoticed_without_work": unnoticed_up_to(felt, wanted, FREQUENCIES, WEBER_WITHOUT_WORK),
            "error_own_mm": 1e3 * error_size(recording, reference, own, begin, end),
        }
    return {name: value.tolist() if isinstance(value, np.ndarray) else _listed(value) for name, value in found.items()}


def _listed(value: Any) -> Any:
    """Arrays in a list, such as real and imaginary parts, as JSON takes them."""
    return [one.tolist() if isinstance(one, np.ndarray) else one for one in value] if isinstance(value, list) else value
