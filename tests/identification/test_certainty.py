"""Standard deviations of estimates against those of many estimates, for a linear model."""

from types import SimpleNamespace

import numpy as np
import pytest

from baselines.identification.fit.certainty import NORMAL, certainty_of
from baselines.identification.fit.estimate import Fit
from baselines.identification.fit.free_parameters import FREE_PARAMETERS
from baselines.identification.windows.starts import Noise
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

WINDOWS, ROWS, COUNT, TRIALS = 60, 40, 3, 3000


def estimates(errors: Array, slopes: Array) -> tuple[Array, list[Fit]]:
    """Least squares estimates (T, Q) of zero for errors (T, W, R) of a linear model with slopes (W, R, Q), and the fits."""
    tall = slopes.reshape(-1, COUNT)
    found = errors.reshape(len(errors), -1) @ np.linalg.pinv(tall).T
    fits = []
    for theta, error in zip(found, errors, strict=True):
        residual = error - slopes @ theta
        problem = SimpleNamespace(
            derivatives=-slopes,
            settled=lambda _, residual=residual: (None, residual),
            spread=np.ones(COUNT),
            free=FREE_PARAMETERS[:COUNT],
        )
        fits.append(Fit(FREE_PARAMETERS[:COUNT], theta, Parameters(), problem, -tall, Noise(1.0, 1.0), 0.0))  # type: ignore[arg-type]
    return found, fits


@pytest.mark.parametrize("lasting", [0.0, 0.7])
def test_deviations_are_those_of_many_estimates(lasting: float) -> None:
    """White noise, and noise of which a part lasts for a whole window, which the noise alone would take for less."""
    rng = np.random.default_rng(5)
    slopes = rng.normal(size=(WINDOWS, ROWS, COUNT)) + 0.7 * rng.normal(size=(WINDOWS, 1, COUNT))
    errors = rng.normal(size=(TRIALS, WINDOWS, ROWS)) + lasting * rng.normal(size=(TRIALS, WINDOWS, 1))
    found, fits = estimates(errors, slopes)
    spread = found.std(axis=0)
    known = [certainty_of(fit) for fit in fits[:400]]
    noise, windows, used = (
        np.mean([getattr(one, name) for one in known], axis=0) for name in ("noise", "windows", "deviation")
    )
    # The spread of 3000 estimates is known to 1.3 %; that of 60 windows is small by some per cent.
    if lasting:
        assert (spread > 1.5 * noise).all()
    else:
        assert np.allclose(noise, spread, rtol=0.05)
    assert np.allclose(windows, spread, rtol=0.12)
    assert (used >= noise).all()
    inside = [np.abs(theta) < NORMAL * one.deviation for theta, one in zip(found, known, strict=False)]
    assert 0.92 < np.mean(inside) < 0.985


def test_the_weakest_direction_is_named() -> None:
    """Two columns that are nearly the same: only their sum is known."""
    rng = np.random.default_rng(1)
    slopes = rng.normal(size=(WINDOWS, ROWS, COUNT))
    slopes[..., 1] = slopes[..., 0] + 0.01 * rng.normal(size=(WINDOWS, ROWS))
    _, fits = estimates(rng.normal(size=(1, WINDOWS, ROWS)), slopes)
    known = certainty_of(fits[0])
    names = [FREE_PARAMETERS[k].name for k in range(2)]
    assert sorted(name for name, _ in known.weakest[0].parts) == sorted(names)
    parts = dict(known.weakest[0].parts)
    assert parts[names[0]] * parts[names[1]] == pytest.approx(-0.5, abs=0.01)
    assert known.determined.tolist() == [False, False, True]
