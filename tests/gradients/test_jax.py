"""JAX through the closed loop: as PyTorch, under ``jit``, and the way that lanes take anew."""

from typing import Any

import gymnasium
import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="pip install -e '.[jax]'")
torch = pytest.importorskip("torch", reason="the extra 'agents' is not installed")

from agents.gradients import rollouts  # noqa: E402
from agents.gradients.jax_rollouts import Worlds  # noqa: E402


def lanes() -> Any:
    return gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=3, duration=0.04, autoreset_mode="SameStep")


def test_gradients_are_those_of_torch_also_compiled() -> None:
    """Five steps, an episode ends after the fourth; a policy with two weights reads observations."""
    worlds, others = Worlds(lanes()), rollouts.Worlds(lanes())
    start, weights = worlds.reset(seed=1), np.array([0.3, -0.02], dtype=np.float32)

    def jax_loss(chosen: Any) -> Any:
        now, total = start, 0.0
        for _ in range(5):
            now = worlds.step(now, jax.numpy.tanh(chosen[0] * now.observation[:, :4] + chosen[1]))
            total = total + now.reward.sum() + 100.0 * now.motion[0].sum()
        return total

    chosen = torch.tensor(weights, requires_grad=True)
    now, loss = others.reset(seed=1), torch.zeros(())
    for _ in range(5):
        now = others.step(now, torch.tanh(chosen[0] * now.observation[:, :4] + chosen[1]))
        loss = loss + now.reward.sum() + 100.0 * now.motion[0].sum()
    loss.backward()
    value, found = jax.value_and_grad(jax_loss)(weights)
    np.testing.assert_allclose(value, float(loss.detach()), rtol=1e-5)
    np.testing.assert_allclose(found, chosen.grad.numpy(), rtol=1e-4)
    compiled = jax.jit(jax.value_and_grad(jax_loss))
    compiled(weights + np.float32(0.1))
    np.testing.assert_allclose(compiled(weights)[1], found, rtol=1e-5)


def test_other_actions_from_any_step_go_their_own_way() -> None:
    worlds = Worlds(lanes())
    start, zero = worlds.reset(seed=1), np.zeros((3, 4), dtype=np.float32)
    first = worlds.step(start, zero)
    second, other = worlds.step(first, zero), worlds.step(first, zero + np.float32(0.5))
    again = worlds.step(first, zero)
    assert np.array_equal(second.state, again.state)
    assert not np.array_equal(second.state, other.state)
