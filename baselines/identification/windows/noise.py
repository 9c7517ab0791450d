"""The noise of pressures and positions: guessed from a log alone, and from the residuals of a fit."""

import numpy as np

from baselines.identification.log.trial import Trial, fresh_rows
from baselines.identification.windows.starts import Noise, Slopes
from baselines.identification.windows.windows import Windows
from birthsim_env.physics.compiled.lanes import Array

LEAST = Noise(1.0, 1e-7)
"""Pa and m: less noise than this is taken for this."""

GAUSS = 1.4826
"""Standard deviation over median size of a normal number."""


SOME = 48
"""Samples among which the noise is taken for the same: a tracker's grows with the distance from its transmitter."""


POOR = 2.5
"""Residuals over the noise with which a search whose budget ends has found nothing; assumed."""


def is_fitting(windows: Windows, residual: Array) -> bool:
    """Whether residuals (W, R + F), over the noise, are those of a fit that tells something."""
    counted = float(np.sum(windows.pressure_weights**2) + windows.trial.axes * np.sum(windows.position_weights**2))
    return float(np.sum(residual**2)) < POOR**2 * counted


def guessed_noise(trial: Trial) -> Noise:
    """From third differences, which leave little of the motion."""
    seen = trial.positions[:, fresh_rows(trial.positions)]
    # That of encoders is several times larger along one axis than along the other.
    axes = [seen] if trial.counted is None else [axis[None] for axis in seen]
    count = 1 if trial.counted is None else trial.axes
    pressure, position = noise_of(trial.pressures), float(np.sqrt(sum(noise_of(one) ** 2 for one in axes) / count))
    return Noise(max(pressure, LEAST.pressure), max(position, LEAST.position))


def cell_noises(trial: Trial) -> Array:
    """Of each chamber's pressure, (4,), Pa, from third differences."""
    return np.array([max(noise_of(own[None]), LEAST.pressure) for own in trial.pressures])


def noise_of(values: Array) -> float:
    """RMS of the noise of values (C, N), NaN where there are none: of medians, which jumps do not move.

    White noise makes third differences (1 + 9 + 9 + 1)^(1/2) as large.
    """
    left = np.abs(np.diff(values, 3, axis=1)) / 20**0.5
    parts = np.array_split(left, max(1, left.shape[1] // SOME), axis=1)
    sizes = [part[np.isfinite(part)] for part in parts]
    return GAUSS * float(np.sqrt(np.mean([float(np.median(size)) ** 2 for size in sizes if len(size)] or [0.0])))


def noise_from(windows: Windows, noise: Noise, slopes: Slopes, residual: Array) -> Noise:
    """From residuals (W, R + 14) over ``noise``, less the degrees of freedom that the start states take from each kind."""
    pressures = windows.length * 4
    last = pressures + windows.positions.shape[1] * 2
    found = []
    for part, counted, before in (
        (slice(0, pressures), float(np.sum(windows.pressure_weights**2)), noise.pressure),
        (slice(pressures, last), windows.trial.axes * float(np.sum(windows.position_weights**2)), noise.position),
    ):
        freedom = counted - float(np.sum(slopes.basis[:, part] ** 2))
        found.append(before * float(np.sum(residual[:, part] ** 2) / max(freedom, 1.0)) ** 0.5)
    return Noise(max(found[0], LEAST.pressure), max(found[1], LEAST.position))
