"""PyTorch through the closed loop: a loss of one's own, the end of an episode, and a policy that learns."""

from runpy import run_path
from typing import Any

import gymnasium
import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra 'agents' is not installed")

from agents.gradients.rollouts import Worlds  # noqa: E402
from tests.build.targets import need_threads  # noqa: E402
from tests.console import ROOT  # noqa: E402


def worlds_of(lanes: int, **arguments: Any) -> Worlds:
    return Worlds(gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=lanes, autoreset_mode="SameStep", **arguments))


def test_a_loss_of_ones_own_goes_back_through_the_loop() -> None:
    """The place after three steps, by openings before them, is the difference of two runs."""

    def place(openings: Any) -> Any:
        worlds = worlds_of(3)
        now = worlds.reset(seed=1)
        for _ in range(3):
            now = worlds.step(now, openings)
        return now.motion[0].sum() * 1e3

    openings = torch.full((3, 4), 0.2, requires_grad=True)
    place(openings).backward()
    way = np.random.default_rng(0).standard_normal((3, 4)).astype(np.float32)
    ends = [float(place(openings.detach() + size * torch.from_numpy(way))) for size in (3e-4, -3e-4)]
    assert float((openings.grad * torch.from_numpy(way)).sum()) == pytest.approx((ends[0] - ends[1]) / 6e-4, rel=1e-3)


def test_the_end_of_an_episode_cuts_gradients() -> None:
    """A new episode owes nothing to the actions of the one before; the last reward of that one does."""
    worlds = worlds_of(2, duration=0.02)
    now = worlds.reset(seed=1)
    actions = [torch.full((2, 4), 0.2, requires_grad=True) for _ in range(3)]
    for k, action in enumerate(actions):
        now = worlds.step(now, action)
        assert bool(now.ended.all()) == (k == 1)
        if k == 1:
            last = now.reward.sum()
    now.motion.sum().backward(retain_graph=True)
    assert float(actions[1].grad.abs().max()) == 0.0
    assert float(actions[2].grad.abs().max()) > 0.0
    last.backward()
    assert float(actions[1].grad.abs().max()) > 0.0


def test_the_last_step_of_an_episode_has_the_gradients_of_any_other() -> None:
    """Where the next episode has another rig."""
    found = []
    for steps in (1, 2):
        worlds = worlds_of(3, randomize=True, max_episode_steps=steps)
        action = torch.full((3, 4), 0.2, requires_grad=True)
        now = worlds.step(worlds.reset(seed=1), action)
        assert bool(now.ended.all()) == (steps == 1)
        now.reward.sum().backward()
        found.append(action.grad.numpy())
    assert np.abs(found[0]).max() > 0.0
    np.testing.assert_array_equal(*found)


@pytest.mark.slow
@pytest.mark.weekly
def test_the_example_learns_in_two_hundred_updates() -> None:
    """Shut valves, at which it begins, leave 3 to 5 mm once hands push."""
    errors = run_path(f"{ROOT}/examples/gradients.py")["train"](200)
    assert np.median(errors[-20:]) < 1.5
    assert np.median(errors[20:60]) > 3.0


@pytest.mark.parametrize("sensors", ["ideal", pytest.param("honest", marks=pytest.mark.weekly)])
def test_gradients_of_lanes_on_a_device_have_the_bits_of_those_here(sensors: str, device: str) -> None:
    """Over the ends of episodes, where other rigs begin."""
    found = []
    for place in ("cpu", device):
        worlds = worlds_of(5, randomize=True, max_episode_steps=3, sensors=sensors, device=place)
        now, loss = worlds.reset(seed=1, options={"staggered": True}), 0.0
        actions = 0.4 * torch.sin(torch.arange(100.0).reshape(5, 5, 4))
        actions.requires_grad = True
        for action in actions:
            now = worlds.step(now, action.to(now.reward.device))
            loss = loss - now.reward.mean() + (now.motion**2).sum() + now.state[2].sum() + now.observation.sum()
        loss.backward()
        found.append((now, actions.grad))
    (one, by_one), (other, by_other) = found
    assert float(by_one.abs().min()) > 0.0
    for here, there in zip((*one, by_one), (*other, by_other), strict=True):
        np.testing.assert_array_equal(here.detach().numpy(), there.detach().cpu().numpy())


@pytest.mark.slow
def test_a_policy_learns_the_circle_by_gradients_of_a_device() -> None:
    need_threads()
    train = run_path(f"{ROOT}/examples/device_policy_gradient.py")["train"]
    errors = train("host", 120, 32)
    assert np.median(errors[-20:]) < 0.3 * np.median(errors[:20])
    assert train("cpu", 10, 32) == errors[:10]
