"""The differentiated plant: bits of the primal, gradients against differences and against forward mode, chain rule, vectors."""

import platform
import re

import numba
import numpy as np
import pytest

from birthsim_env.gradients.plant import Derivatives, jvp, vjp
from birthsim_env.gradients.right_hand_side import INPUTS, RIG, made
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.gradients.states import SCALES, plant_of

DURATION = 0.01


def along(lanes: int, rig: Array, samples: int, seed: int) -> Derivatives:
    """A random direction of everything."""
    rng = np.random.default_rng(seed)
    changes = np.zeros_like(rig)
    changes[list(RIG)] = 0.1 * rng.standard_normal((len(RIG), lanes)) * rig[list(RIG)]
    normal = rng.standard_normal
    return Derivatives(SCALES * normal((18, lanes)), 0.1 * normal((4, lanes)), normal((samples, 2, lanes)), changes)


@pytest.mark.slow
def test_taped_and_tangent_steps_have_the_bits_of_the_plant() -> None:
    (plant, opening, force), (other, _, _), (third, _, _) = (plant_of(37, 0) for _ in range(3))
    forces = np.stack([force, -0.5 * force])
    plant.advance(opening, forces, DURATION)
    vjp(other, opening, forces, DURATION)
    jvp(third, opening, forces, DURATION, along(37, third.lane_parameters, 2, 1))
    assert np.array_equal(plant.state, other.state)
    assert np.array_equal(plant.impacts, other.impacts)
    assert np.array_equal(plant.state, third.state)


def test_gradients_are_differences_on_drawn_rigs() -> None:
    """1000 states far from rest over 10 ms: 99 % within 1e-6; the rest is on a kink, and within it of a smaller difference."""
    plant, opening, force = plant_of(1000, 3)
    plant.lane_parameters[[at.FP1, at.FP2], ::2] = 6e-6
    plant.lane_parameters[[at.ASYMMETRY1, at.ASYMMETRY2], ::3] = 0.2
    state, rig = plant.state.copy(), plant.lane_parameters.copy()
    way, weight = along(1000, rig, 1, 4), np.random.default_rng(5).standard_normal((18, 1000)) / SCALES
    assert way.rig is not None

    def reached(size: float) -> Array:
        plant.lane_parameters[:], plant.state[:] = rig + size * way.rig, state + size * way.state
        plant.advance_unchecked(opening + size * way.opening, force[None] + size * way.force, DURATION)
        return (weight * plant.state).sum(axis=0)

    plant.lane_parameters[:], plant.state[:] = rig, state
    got = weight * jvp(plant, opening, force[None], DURATION, way)

    def off(size: float) -> Array:
        difference = (reached(size) - reached(-size)) / (2 * size)
        return np.abs(difference - got.sum(axis=0)) / np.abs(got).sum(axis=0)

    large = off(1e-5)
    assert np.quantile(large, 0.5) < 1e-9
    assert np.mean(large < 1e-6) >= 0.99
    assert np.all(off(1e-6) < 1e-6)


@pytest.mark.slow
def test_reverse_is_forward_mode() -> None:
    plant, opening, force = plant_of(256, 6)
    state, forces = plant.state.copy(), np.stack([force, 0.3 * force])
    way, weight = along(256, plant.lane_parameters, 2, 7), np.random.default_rng(8).standard_normal((18, 256)) / SCALES
    forward = weight * jvp(plant, opening, forces, DURATION, way)
    plant.state[:] = state
    pullback = plant.vjp(opening, forces, DURATION)
    back = pullback(weight, rig=True)
    assert back.rig is not None
    assert way.rig is not None
    pairs = ((back.state, way.state), (back.opening, way.opening), (back.force, way.force), (back.rig, way.rig))
    reverse = sum((a * b).reshape(-1, 256).sum(axis=0) for a, b in pairs)
    assert np.all(np.abs(forward.sum(axis=0) - reverse) <= 1e-12 * np.abs(forward).sum(axis=0))
    few = pullback(weight)
    assert few.rig is None
    np.testing.assert_allclose(few.state, back.state, rtol=1e-12, atol=1e-12 * np.abs(back.state).max())


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads the processor's instructions")
@pytest.mark.slow
def test_the_adjoint_runs_on_vectors() -> None:
    """Vectorisation breaks in silence: a division of four lanes for every one in the source."""
    adjoint = made.adjoint

    @numba.njit(error_model="numpy")
    def alone(x: Array, g: Array, out: Array, n: int) -> None:
        here, u, f, p = np.zeros((18, BLOCK)), np.zeros((4, BLOCK)), np.zeros((2, BLOCK)), np.zeros((at.PARAMETERS, BLOCK))
        weight, found = np.zeros((18, BLOCK)), np.zeros((INPUTS, BLOCK))
        here[:], weight[:], p[:] = x, g, 1.0
        adjoint(here, u, f, p, weight, found, n)
        out[:] = found

    kind = numba.types.Array(numba.float64, 2, "C")
    alone.compile((kind, kind, kind, numba.int64))
    text = alone.inspect_asm()[(kind, kind, kind, numba.int64)]
    assert len(re.findall(r"\bv?divpd\b", text)) >= len(re.findall(r"\bv?divsd\b", text)) > 0
