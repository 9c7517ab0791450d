"""A law on the control model, which weighs less than it believes: a constant push that no sensor sees.

Each law's loop is then linear. ``expected`` solves its equations, as a test writes them, by the exponential of a matrix.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from baselines.rivals.tracking import TrackingController
from birthsim_env.physics.compiled.lanes import Array
from tests.oracles import derived_law as derived
from tests.oracles.closed_loop import IDEAL
from tests.rivals.test_rival_laws import PERIOD, beside_rest, on_the_model

WEIGHTLESS = IDEAL.replace({"mechanics.gravity": 0.0})
BELIEVED = IDEAL.replace({"mechanics.gravity": 0.5})
"""What a law is to believe. Gravity proper would couple the pistons, which the laws' linear models do not have."""

BESIDE = np.array([0.0, 1e-4])
"""m; where the pistons start beside their motion. The push is along cylinder 1, nearly."""


class Pushed(NamedTuple):
    """What a law did from rest under the push; cylinders 1 and 2."""

    error: Array
    """m, (T, 2)."""
    push: Array
    """The push over the apparent mass, m/s2, (2,)."""
    viscous: Array
    """Fv over the apparent mass, 1/s, (2,)."""


def pushed(law: TrackingController, seconds: float) -> Pushed:
    """A law that believes ``BELIEVED`` on the control model of ``WEIGHTLESS``."""
    start, reference, _, scale = beside_rest(BELIEVED, BESIDE)
    path = np.array(list(on_the_model(law, WEIGHTLESS, start, reference, seconds)))
    push = np.array(derived.accelerations(WEIGHTLESS, 0.01, True)(*start[:4], *derived.forces(start[4:], WEIGHTLESS)))
    viscous = np.array([IDEAL.cylinder1.viscous_friction, IDEAL.cylinder2.viscous_friction])
    return Pushed(path[:, :2] - start[:2] + BESIDE, push, viscous / (IDEAL.mechanics.mass * scale**2))


def expected(rates: Array, start: Array, ticks: int) -> Array:
    """(ticks, S): dx/dt = ``rates`` x at the control periods."""
    step, states = expm(rates * PERIOD), [start]
    for _ in range(ticks - 1):
        states.append(step @ states[-1])
    return np.array(states)
