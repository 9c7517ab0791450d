"""Policies with a memory by gradients: what goes back through the memory and the plant, what is carried, and what it is for."""

from dataclasses import replace
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
import torch

from agents.gradients.rollouts import Now
from agents.policy.controller import ResidualController
from agents.policy.files import read_policy
from agents.policy.onnx_export import export_onnx
from agents.residual.privileged import TRUE_PARAMETERS, with_true_parameters
from agents.training.by_gradients import lanes as module
from agents.training.by_gradients.lanes import Lanes
from agents.training.by_gradients.policy_gradient import PolicyGradient
from agents.training.differentiated import Differentiated
from agents.training.trainer import train
from baselines.bench.evaluation import evaluate
from birthsim_env.observation import SIZE
from birthsim_env.reward import LARGEST_COST
from tests.training.test_policy_gradient import PURE, SHORT

LANES, EPISODE = 16, 6
MEMORY = replace(SHORT, memory=6, rollout=16, horizon=8, hidden=(12,))


class Toy:
    """A sign is seen at the beginning of an episode alone, and each action should be that; or, where the plant ``answers``, a
    place that actions move should be. An observation has the place, and the sign while it is seen."""

    def __init__(self, answers):
        self.answers, self.rng, self.steps = answers, torch.Generator().manual_seed(0), 0
        clock = SimpleNamespace(periods=1, period=0.01, force=None, reference=None, plant=SimpleNamespace(num_envs=LANES))
        self.env = SimpleNamespace(simulation=clock)

    def reset(self, **_):
        self.signs = torch.randint(0, 2, (LANES,), generator=self.rng).double() * 2 - 1
        return self.seen(torch.zeros(LANES).double(), torch.zeros(LANES).double(), True)

    def seen(self, place, cost, begins):
        rest = torch.zeros(LANES, SIZE - 2).double()
        observation = torch.cat([torch.stack([place, self.signs * begins], 1), rest], 1)
        # What ``Lanes`` takes the exponential of.
        reward = 1.0 - torch.log(1.0 + cost) / LARGEST_COST
        ended = torch.full((LANES,), begins)
        return Now(torch.zeros(0, LANES), observation, reward, torch.zeros(4, LANES), torch.zeros(18, LANES), ended)

    def step(self, now, action):
        self.steps += 1
        place = 0.9 * now.observation[:, 0] + 0.3 * action[:, 0] if self.answers else now.observation[:, 0]
        cost = ((place if self.answers else action[:, 0]) - self.signs) ** 2
        if self.steps % EPISODE:
            return self.seen(place, cost, False)
        self.signs = torch.randint(0, 2, (LANES,), generator=self.rng).double() * 2 - 1
        return self.seen(torch.zeros(LANES).double(), cost, True)


def toy(monkeypatch, rollout, horizon, cells, answers=False):
    """Lanes of the toy, from whose beginning every call of the second result costs again, and a policy in doubles."""
    monkeypatch.setattr(module, "Worlds", lambda env: Toy(answers))
    torch.manual_seed(1)
    policy = Differentiated(SIZE, 1, (8,), cells, squashed=True).double()
    torch.nn.init.normal_(policy.last.weight, std=0.5)
    settings = replace(SHORT, rollout=rollout, horizon=horizon, memory=cells, discount=0.9)

    def act(seen, held):
        actions, held = policy(seen[None], held.double())
        return actions[0], held

    return Lanes(settings, None, [0] * LANES), policy, act


@pytest.mark.parametrize(("horizon", "answers"), [(4, True), (2, False)])
def test_the_gradient_of_a_rollout_is_its_finite_difference(monkeypatch, horizon, answers):
    """In some directions of each layer's weights, over the end of an episode. Where the plant does not answer, all of it comes
    through the memory, so that a shorter horizon takes nothing away."""
    monkeypatch.setitem(globals(), "EPISODE", 3)
    rng, size = np.random.default_rng(0), 1e-6

    def cost(ahead=0.0, part=0, way=()):
        """Of the policy whose weights are those at the beginning, those of its ``part`` so far ``ahead`` along a ``way``."""
        lanes, policy, act = toy(monkeypatch, 4, horizon, 3, answers=answers)
        with torch.no_grad():
            for weight, along in zip(parts(policy)[part], way, strict=False):
                weight += ahead * torch.from_numpy(along)
        return policy, lanes.cost(act)

    def parts(policy):
        return [list(one.parameters()) for one in (policy.hidden, policy.memory, policy.last)]

    policy, paid = cost()
    paid.backward()
    for part in (0, 1, 1, 1, 1, 2):
        weights = parts(policy)[part]
        way = [rng.standard_normal(tuple(weight.shape)) for weight in weights]
        found = sum((weight.grad.numpy() * along).sum() for weight, along in zip(weights, way, strict=True))
        ends = [cost(ahead, part, way)[1].item() for ahead in (size, -size)]
        assert found == pytest.approx((ends[0] - ends[1]) / (2 * size), rel=1e-5)
        assert abs(found) > 1e-3


def test_gradients_of_the_plant_end_at_a_horizon_and_those_of_the_memory_do_not(monkeypatch):
    """Without a memory a rollout of two horizons is two rollouts; with one it is more."""
    found = {}
    for cells in (0, 3):
        for rollout, times in ((4, 1), (2, 2)):
            lanes, policy, act = toy(monkeypatch, rollout, 2, cells, answers=True)
            for _ in range(times):
                lanes.cost(act).backward()
            found[cells, rollout] = torch.cat([weight.grad.flatten() for weight in policy.parameters()]).numpy()
    np.testing.assert_allclose(found[0, 4], found[0, 2], rtol=1e-12, atol=1e-15)
    assert np.abs(found[3, 4] - found[3, 2]).max() > 1e-2 * np.abs(found[3, 4]).max()


def test_a_step_costs_at_most_so_much(monkeypatch):
    """A policy that says nothing is off by one in every lane, which costs one and its square."""
    lanes, policy, act = toy(monkeypatch, 1, 1, 0)
    torch.nn.init.zeros_(policy.last.weight)
    assert lanes.cost(act).item() == pytest.approx(2.0)
    lanes._settings = replace(lanes._settings, most_cost=3.0)
    assert lanes.cost(act).item() == pytest.approx(2.0 * 3.0 / 5.0)


def test_what_was_seen_once_is_learned_with_a_memory_and_not_without(monkeypatch):
    reached = {}
    for cells in (0, 8):
        lanes, policy, act = toy(monkeypatch, EPISODE, EPISODE, cells)
        adam = torch.optim.Adam(policy.parameters(), lr=3e-2)
        paid = []
        for _ in range(100):
            adam.zero_grad()
            loss = lanes.cost(act)
            loss.backward()
            adam.step()
            paid.append(loss.item())
        # A step costs one and the square of the error; those that see nothing do best with zero, at one.
        weights = sum(0.9**k for k in range(EPISODE))
        reached[cells] = np.mean(paid[-10:]) / weights - 1.0
    first = 1.0 / weights
    assert reached[0] > 0.9 * (1.0 - first)
    assert reached[8] < 0.05


def learning(tmp_path, **changes):
    """A training whose policy says something, in lanes whose episodes are 20 steps long."""
    settings = replace(MEMORY, lanes=6, noise=0.0, **changes)
    made = {"sensors": settings.sensors, "randomize": True, "duration": 0.4, "autoreset_mode": "SameStep", **PURE.to_dict()}
    learner = PolicyGradient(settings, [gymnasium.make_vec(settings.environment, num_envs=6, **made)], tmp_path)
    torch.nn.init.normal_(learner._policy.last.weight, std=0.3)
    return learner, learner._groups[0]


def test_what_is_remembered_goes_on_and_begins_with_episodes_as_in_the_stored_policy(tmp_path):
    """Three rollouts beside the network that is stored, which observes the same, forgets where episodes begin, and is never
    interrupted."""
    learner, group = learning(tmp_path)
    steps, ends, step = [], [], group.worlds.step

    def act(seen, held):
        actions, after = learner._act(seen, held)
        steps.append((seen.detach().numpy(), held.detach().numpy(), actions.detach().numpy()))
        return actions, after

    def stepped(now, action):
        now = step(now, action)
        ends.append(now.ended.numpy())
        return now

    group.worlds.step = stepped
    for _ in range(3):
        group.cost(act)
        assert not group.held.requires_grad
    acts, differs = learner.network().acting(), 0.0
    alone = learner.network()
    for k, (seen, held, actions) in enumerate(steps):
        if k:
            acts.reset(ends[k - 1])
            assert not held[ends[k - 1]].any()
        # Singles in PyTorch, doubles here, over at most twenty steps of a memory below one.
        np.testing.assert_allclose(acts(seen.astype(np.float32)), actions, rtol=0, atol=2e-6)
        differs = max(differs, np.abs(alone.actions(seen.astype(np.float32)) - actions).max())
    assert differs > 1e-2, "what it remembers matters"
    assert 0 < np.sum(ends) < np.size(ends)
    held, chosen = group.held.clone(), np.array([True, False] * 3)
    group.begin(chosen)
    assert held[chosen].any()
    assert not group.held[chosen].any()
    assert torch.equal(group.held[~chosen], held[~chosen])


def test_a_policy_with_a_memory_is_a_folder_like_any_other(tmp_path):
    """In a controller a compiled stage and a function of Python have the same bits, and it is exported."""
    reached = train(replace(MEMORY, steps=4096), PURE, tmp_path)
    assert reached["policy"]["pooled_mm"] < reached["law"]["pooled_mm"]
    policy = read_policy(tmp_path)
    assert (policy.network.cells, policy.network.squashed, policy.training["memory"]) == (6, True, 6)
    compiled, function = ResidualController(None, tmp_path), ResidualController(None, policy.network.acting(), PURE)
    assert (compiled.is_compiled(), function.is_compiled()) == (True, False)
    runs = [evaluate("BirthSIM/Probe-v3", one, "", 2, 5, duration=1.0) for one in (compiled, function)]
    for name, values in runs[0].metrics.items():
        np.testing.assert_array_equal(runs[1].metrics[name], values)
    assert export_onnx(policy, tmp_path / "policy.onnx").observations > 0


@pytest.mark.parametrize("cells", [0, 6])
def test_a_privileged_policy_is_told_its_rig_at_every_step(tmp_path, cells):
    learner, group = learning(tmp_path, memory=cells, privileged=True, sensors="honest")
    told = []

    def act(seen, held):
        expected = with_true_parameters(group.worlds.env, seen[:, :-TRUE_PARAMETERS].detach().numpy())
        np.testing.assert_array_equal(seen.detach().numpy(), expected)
        told.append(expected[:, -TRUE_PARAMETERS:])
        return learner._act(seen, held)

    group.cost(act)
    group.cost(act).backward()
    # Masses change where episodes have ended.
    masses = np.array(told)[:, :, 0]
    assert 0 < (np.diff(masses, axis=0) != 0).sum() <= 2 * 6
    weights = learner._policy.hidden[0].weight.grad[:, -TRUE_PARAMETERS:]
    assert (weights[:, 0] != 0).all(), "what is told counts"
