"""What sensors add: found again where it was added to a log without it."""

import dataclasses

import numpy as np

from baselines.identification.fit.free_parameters import FREE_PARAMETERS, coordinates
from baselines.identification.fit.problem import Problem
from baselines.identification.windows.noise import guessed_noise
from baselines.identification.windows.windows import cut
from tests.identification.trials import TRUE, part, trial

BIAS = np.array([1500.0, -900.0, 600.0, -1800.0])


def bent(positions: np.ndarray) -> np.ndarray:
    """m: waves of 0.6 m, 1 mm of RMS, that are zero where the tracker is registered."""
    x, y = positions
    return 1.4e-3 * np.array([np.sin(10.5 * (x - 0.5)), np.cos(10.5 * y) - 1.0])


def test_biases_and_distortion_that_are_added_to_a_log_are_found() -> None:
    exact = part(trial(), 0, 3000)
    odd = dataclasses.replace(
        exact, pressures=exact.pressures + BIAS[:, None], positions=exact.positions + bent(exact.positions)
    )
    found, theta = [], coordinates(TRUE, FREE_PARAMETERS)
    for log in (exact, odd):
        problem = Problem(cut(log, TRUE), guessed_noise(exact), TRUE, FREE_PARAMETERS, lambda: None)
        problem.settled(theta)
        shown, corrected = problem.windows, problem.offsets.corrected()
        bias = (shown.pressures - corrected.pressures)[0, 0]
        field = (shown.positions - corrected.positions)[shown.valid]
        found.append((bias, field, shown.positions[shown.valid]))
    (none, flat, places), (bias, field, _) = found
    # What noise feigns where there is nothing is the accuracy; the field turns with the workspace, not with the samples.
    assert np.abs(none).max() < 300.0
    assert np.abs(bias - BIAS - none).max() < 300.0
    assert np.sqrt(np.mean((field - flat - bent(places.T).T) ** 2)) < 1e-4
