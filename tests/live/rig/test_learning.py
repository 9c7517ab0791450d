"""What the page learns with computes the gradients of training in PyTorch, and the rig runs what was learned."""

import base64
from itertools import pairwise

import numpy as np
import pytest
import torch

from agents import TrainingSettings, load_policy
from agents.policy.seeds import best_policy
from agents.training.by_gradients.lanes import Lanes
from agents.training.validation import TRAINING_SEED
from birthsim_live.rig.learning import worlds
from birthsim_live.rig.pack import LEARNED
from tests.live.rig.worker import node, run

COUNT = 8
BEGUN = """
import { Learner } from "./learning/learner.js";
import { Adam, Network } from "./learning/network.js";

const about = { ...JSON.parse(readFileSync("rig/learn.json")), ...given.about };
const bytes = readFileSync("rig/learn.bin");
const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
const learner = new Learner(new WebAssembly.Module(readFileSync("rig/learn.wasm")), about, data);
"""
GRADIENT = """
learner.left.forEach((_, lane) => learner.lanes.begin(lane, lane));
learner.network.weights.set(given.weights);
learner.back(learner.forward());
console.log(JSON.stringify([text(learner.network.gradient), text(learner.lanes.seen), learner.left]));
"""
LOST = """
import { Hub } from "./worker/hub.js";

const found = ["learning", "pid"].map((controller) => {
  const hub = new Hub(pack, bundle, () => {});
  hub.session.change({ controller });
  hub.session.lost = "too hot";
  const before = hub.session.lost;
  hub.on_learned({ network: null });
  return [before, hub.session.lost];
});
console.log(JSON.stringify(found));
"""
ADAM = """
const network = new Network([2, 1]);
const adam = new Adam(network, about.moments);
for (const [k, gradient] of given.gradients.entries()) {
  network.gradient.set(gradient);
  adam.step(given.rates[k]);
}
console.log(JSON.stringify(Array.from(network.weights)));
"""


def numbers(text):
    return np.frombuffer(base64.b64decode(text))


@pytest.mark.parametrize(("horizon", "steps"), [(10, 1600), (5, 40)])
def test_gradients_are_those_of_training(page, horizon, steps):
    """With 40 steps the last of eight lanes, which begin staggered, ends with the fifth step."""
    env = worlds(COUNT)
    env.steps = steps
    settings = TrainingSettings(environment="BirthSIM/CircleResidual-v2", rollout=horizon, discount=1.0)
    lanes = Lanes(settings, env, [TRAINING_SEED + lane for lane in range(COUNT)])
    about = node(page, BEGUN + "console.log(JSON.stringify(about));", {})
    torch.manual_seed(0)  # no weight is zero
    widths = pairwise([len(about["mean"]), *about["hidden"], 4])
    parts = [part for pair in widths for part in (torch.nn.Linear(*pair), torch.nn.Tanh())]
    policy = torch.nn.Sequential(*parts).double()
    mean, deviation = (torch.tensor(about[name], dtype=torch.float64) for name in ("mean", "deviation"))

    def decided(seen, held):
        return policy(((seen - mean) / deviation).clamp(-about["clip"], about["clip"])), held

    lanes.cost(decided).backward()
    asked = {"lanes": COUNT, "horizon": horizon, "steps": steps}
    weights = torch.cat([one.detach().flatten() for one in policy.parameters()]).tolist()
    gradient, seen, left = node(page, BEGUN + GRADIENT, {"about": asked, "weights": weights})
    expected = torch.cat([one.grad.flatten() for one in policy.parameters() if one.grad is not None]).numpy()
    assert np.abs(numbers(gradient) - expected).max() < 1e-6 * np.abs(expected).max()
    going = np.arange(COUNT) < (COUNT if steps > 40 else COUNT - 1)
    assert [k == steps for k in left] == (~going).tolist()
    observed = numbers(seen).reshape(COUNT, -1)
    np.testing.assert_allclose(observed[going], lanes.now.observation.detach().numpy()[going], rtol=1e-5, atol=1e-6)


def test_an_update_is_one_of_adam(page):
    gradients, rates = np.random.default_rng(0).normal(size=(3, 3)), [0.1, 0.05, 0.02]
    weights = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    adam = torch.optim.Adam([weights], betas=(0.9, 0.99))
    for gradient, rate in zip(gradients, rates, strict=True):
        adam.param_groups[0]["lr"] = rate
        weights.grad = torch.from_numpy(gradient / np.linalg.norm(gradient))
        adam.step()
    stuck = [*gradients.tolist(), [float("1e999"), 0.0, 0.0], [0.0, 0.0, 0.0]]
    given = {"gradients": [[min(value, 1e300) for value in one] for one in stuck], "rates": [*rates, 1.0, 1.0]}
    found = node(page, BEGUN + ADAM, given)
    np.testing.assert_allclose(found, weights.detach().numpy(), rtol=1e-9)


def test_the_rig_runs_what_was_learned(page):
    """A policy that is shipped, taught to the controller that learns, has the bits of that policy's own controller."""
    network = load_policy(best_policy(LEARNED.partition(":")[2])).network
    taught = {
        "widths": [network.inputs, *(len(bias) for _, bias in network.layers)],
        "weights": np.concatenate([array.ravel() for one in network.layers for array in one]).tolist(),
        "mean": network.mean.tolist(), "deviation": np.sqrt(network.variance + 1e-8).tolist(),
    }  # fmt: skip
    world = {"scenario": "circle", "scenario_force": True}

    def case(name, *taught):
        return [("set", {**world, "controller": name}), ("reset", None), *taught, ("advance", 200)]

    own, learned, none = run(page, case(LEARNED), case("learning", ("teach", taught)), case("learning"))
    assert np.array_equal(own[-1].row, learned[-1].row, equal_nan=True)
    assert not none[-1].of("openings").any()
    assert own[-1].of("openings").any()


def test_a_rig_that_it_lost_begins_anew_when_more_is_known(page):
    assert node(page, LOST) == [["too hot", None], ["too hot", "too hot"]]  # under another controller nobody helps
