"""Gains beside the limits of what can be rendered, and what is said beyond them."""

import numpy as np
import pytest

from baselines.backstepping import gains
from tests.oracles.gain_range import closed_loop_damping, closed_loop_stiffness

MASS = 3.0


@pytest.mark.parametrize(("stiffness", "viscous"), [(3.3, 0.5), (9.0, 1.0), (60.0, 35.0), (2000.0, 35.0)])
def test_the_least_damping_is_the_least_of_a_fine_search(stiffness: float, viscous: float) -> None:
    """Over all c1 = c3 that leave c2 positive, even where the setpoint is hardly above the least."""
    k, drag = stiffness / MASS, viscous / MASS
    outer = max(np.sqrt(k), k * drag / (2 * (k - 1))) * (1 + np.exp(np.linspace(-14, 6, 40001)))
    inner = gains.inner_gain(outer, stiffness, MASS, viscous)
    assert np.all(inner > 0)
    searched = min(closed_loop_damping(c1, c2, c1, MASS, viscous) for c1, c2 in zip(outer[::4], inner[::4], strict=True))
    assert gains.least_damping(stiffness, MASS, viscous) == pytest.approx(searched, rel=1e-6)


@pytest.mark.parametrize(("stiffness", "viscous"), [(3.3, 0.5), (9.0, 1.0), (60.0, 35.0), (2000.0, 35.0)])
def test_soft_setpoints_get_their_damping_too(stiffness: float, viscous: float) -> None:
    """There the small terms of the polynomial count."""
    damping = 1.5 * gains.least_damping(stiffness, MASS, viscous)
    outer = gains.outer_gain(stiffness, damping, MASS, viscous)
    inner = gains.inner_gain(outer, stiffness, MASS, viscous)
    assert closed_loop_stiffness(outer, inner, outer, MASS, viscous) == pytest.approx(stiffness, rel=1e-9)
    assert closed_loop_damping(outer, inner, outer, MASS, viscous) == pytest.approx(damping, rel=1e-9)


def test_gains_miss_where_they_render_another_damping_by_more_than_a_millionth() -> None:
    stiffness, damping, viscous = 2000.0, 900.0, 35.0
    outer = gains.outer_gain(stiffness, damping, MASS, viscous)
    inner = gains.inner_gain(outer, stiffness, MASS, viscous)
    at = (stiffness, damping, MASS, viscous)
    assert gains.damped_gains_miss(outer * (1 + 1e-8), inner, *at) == 0
    assert gains.damped_gains_miss(outer * (1 + 1e-4), inner, *at) == 1


def test_without_viscous_friction_two_thirds_of_the_mass_is_too_soft() -> None:
    assert gains.equal_gain_misses(2.0, MASS, 0.0) == 1
    assert gains.equal_gain_misses(2.1, MASS, 0.0) == 0
