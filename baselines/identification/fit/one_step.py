"""What a fit lacks, by one Gauss-Newton step: parameters, start states and sensors' errors give way as well."""

from dataclasses import dataclass

import numpy as np

from baselines.identification.fit.certainty import score_products
from baselines.identification.fit.estimate import Fit
from birthsim_env.physics.compiled.lanes import Array


@dataclass(frozen=True)
class Step:
    """The ``value`` (C,) of what a fit lacks, and its standard ``deviation`` (C,), from noise or windows, whichever is larger;
    the ``gain`` is by how much the sum of squared residuals would fall."""

    value: Array
    deviation: Array
    gain: float


def one_step(fit: Fit, columns: Array) -> Step:
    """The step along ``columns`` (W, R + F, C), derivatives of the residuals with respect to what is lacking."""
    problem, count = fit.problem, columns.shape[2]
    _, residual = problem.settled(fit.theta)
    derivatives, bent = problem.offsets.unexplained(problem.slopes.unexplained(columns))
    tall = np.concatenate([derivatives.reshape(-1, count), bent, np.zeros((len(fit.theta), count))])
    every = np.hstack([fit.jacobian, tall])
    covariance = np.linalg.inv(every.T @ every)
    gradient = every.T @ problem.residuals(fit.theta)
    step = -covariance @ gradient
    both = np.concatenate([problem.derivatives, derivatives], axis=2)
    scores = score_products(residual + both @ step, both)
    variance = np.maximum(np.diag(covariance), np.diag(covariance @ scores @ covariance))
    return Step(step[-count:], np.sqrt(variance[-count:]), float(-gradient @ step))
