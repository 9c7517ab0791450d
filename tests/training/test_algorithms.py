"""Algorithms of Stable-Baselines3: each begins as the law, learns, and its network does what its own ``predict`` does."""

import json
import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
import torch

from agents.policy.controller import ResidualController
from agents.policy.files import Policy, read_policy, save_policy
from agents.policy.onnx_export import export_onnx
from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings, algorithm_of
from agents.training.sb3.adapter import SB3VecEnv
from agents.training.sb3.model import make_model, network_of, unchecked_distributions
from baselines.bench.evaluation import evaluate

CIRCLE = "BirthSIM/CircleResidual-v2"
TINY = TrainingSettings(CIRCLE, lanes=8, rollout=32, batch=64, epochs=2, gradient_steps=2, learning_rate=3e-3, hidden=(16, 16))
VARIABLE = ResidualSettings(impedance="variable")
FEEDFORWARD = ("ppo", "sac", "tqc")
MEMORY = replace(TINY, algorithm="recurrent-ppo", memory=12)


def made(settings, residual=VARIABLE, **arguments):
    """A new model and the native environment below its own."""
    torch.set_num_threads(1)
    native = gymnasium.make_vec(CIRCLE, num_envs=settings.lanes, autoreset_mode="SameStep", **residual.to_dict(), **arguments)
    return make_model(algorithm_of(settings.algorithm), settings, SB3VecEnv(native)), native


def observations(native, size, steps=40, seed=77):
    """What policies see, (N, D), on the way under random actions; and what they hardly ever see, within the bounds."""
    rng = np.random.default_rng(0)
    seen = [native.reset(seed=seed)[0]]
    seen += [native.step(rng.uniform(-1, 1, (native.num_envs, size)).astype(np.float32))[0] for _ in range(steps)]
    rows = np.concatenate(seen)
    bounds = native.single_observation_space
    return rows, np.clip(rng.normal(size=rows.shape, scale=5).astype(np.float32), bounds.low, bounds.high)


def rounding(network, inputs):
    """What single precision may change in a model's actions, (N, outputs): inputs, products, sums and tanh are rounded.

    The running bound of numerical analysis, whatever the order of the sums: a sum of n products is off by n units of what its
    terms are in size, tanh passes errors on and adds two units in the last place, and scaling an action rounds four times.
    """
    unit = 2.0**-24
    x = np.clip((inputs - network.mean) / np.sqrt(network.variance + 1e-8), -10, 10)
    error = 2 * unit * np.abs(x)
    for k, (weight, bias) in enumerate(network.layers):
        error = error @ np.abs(weight.T) + (len(weight.T) + 1) * unit * (np.abs(x) @ np.abs(weight.T) + np.abs(bias))
        x = x @ weight.T.astype(np.float64) + bias
        if network.squashed or k + 1 < len(network.layers):
            x, error = np.tanh(x), error + 4 * unit
    return error + 4 * unit


@pytest.mark.parametrize("algorithm", FEEDFORWARD)
def test_before_it_has_learned_a_policy_says_nothing_and_explores_around_that(algorithm):
    model, native = made(replace(TINY, algorithm=algorithm, log_std=-1.0), randomize=True)
    rows, far = observations(native, 5)
    for inputs in (rows, far):
        np.testing.assert_array_equal(network_of(model.algorithm, model.policy).actions(inputs), 0)
        np.testing.assert_array_equal(model.predict(inputs, deterministic=True)[0], 0)
    tried = model.predict(rows, deterministic=False)[0]
    expected = np.tanh(np.exp(-1) * np.random.default_rng(0).normal(size=100_000)).std() if algorithm != "ppo" else np.exp(-1)
    assert tried.std() == pytest.approx(expected, rel=0.1)
    assert abs(tried.mean()) < 0.05
    # The layers below the last one are random: there is something to learn with.
    assert all(weight.any() for weight, _ in network_of(model.algorithm, model.policy).layers[:-1])


@pytest.mark.parametrize("algorithm", FEEDFORWARD)
@pytest.mark.parametrize("hidden", [(16, 16), (8,), (5, 6, 7)])
def test_the_network_taken_from_a_model_does_what_the_model_predicts(algorithm, hidden):
    model, native = made(replace(TINY, algorithm=algorithm, hidden=hidden), randomize=hidden != (8,))
    model.learn(300)
    last = model.policy.action_net if algorithm == "ppo" else model.policy.actor.mu
    with torch.no_grad():
        # As a trained network: actions over most of [-1, 1].
        last.weight.mul_(0.5 / last.weight.norm(dim=1).max())
    taken = network_of(model.algorithm, model.policy)
    assert taken.squashed == (algorithm != "ppo")
    assert len(taken.layers) == len(hidden) + 1
    rows, far = observations(native, 5)
    for inputs in (rows, far):
        expected, _ = model.predict(inputs, deterministic=True)
        actions = taken.actions(inputs)
        assert (np.abs(actions - expected) <= rounding(taken, inputs)).all()
        assert len(np.unique(actions.round(3), axis=0)) > 20
    assert (np.abs(taken.actions(rows)) < 1).mean() > 0.5


@pytest.mark.parametrize("algorithm", FEEDFORWARD)
def test_settings_reach_the_algorithm(algorithm):
    settings = replace(TINY, algorithm=algorithm, discount=0.9, learning_rate=2e-3, seed=5)
    model, _ = made(settings)
    assert (model.gamma, model.batch_size, model.seed, str(model.device)) == (0.9, 64, 5, "cpu")
    # A last rollout that ends beyond the last step leaves less than nothing; the rate stays what it is at the end.
    rates = [model.lr_schedule(left) for left in (1.0, 0.5, 0.0, -4000.0)]
    np.testing.assert_allclose(rates, [2e-3, 1.01e-3, 2e-5, 2e-5])
    if algorithm == "ppo":
        assert (model.n_steps, model.n_epochs, model.gae_lambda) == (32, 2, 0.95)
    else:
        assert (model.gradient_steps, model.train_freq.frequency) == (2, 1)
        # Random actions fill the memory for twenty steps of all lanes.
        assert model.learning_starts == 160


def sequences(native, size, steps=30):
    """Observations (T, N, D) of all lanes on the way under random actions, and where episodes begin (T, N), also midway."""
    rng = np.random.default_rng(0)
    seen = [native.reset(seed=77)[0]]
    seen += [native.step(rng.uniform(-1, 1, (native.num_envs, size)).astype(np.float32))[0] for _ in range(steps - 1)]
    begins = rng.random((steps, native.num_envs)) < 0.1
    begins[0] = True
    return np.stack(seen), begins


def test_a_recurrent_network_remembers_and_forgets_as_the_model_does():
    model, native = made(MEMORY, randomize=True)
    seen, begins = sequences(native, 5)
    np.testing.assert_array_equal(network_of(model.algorithm, model.policy).actions(seen[0]), 0)
    model.learn(300)
    with torch.no_grad():
        last = model.policy.action_net
        last.weight.mul_(0.5 / last.weight.norm(dim=1).max())
    taken = network_of(model.algorithm, model.policy)
    assert (taken.cells, len(taken.layers), taken.squashed) == (12, 3, False)
    acts, state, without = taken.acting(), None, []
    for rows, begun in zip(seen, begins, strict=True):
        expected, state = model.predict(rows, state, begun, deterministic=True)
        acts.reset(begun)
        actions = acts(rows)
        # Thirty steps of sums over 44 numbers in singles, of which a gate hands on less than it got.
        np.testing.assert_allclose(actions, expected, rtol=0, atol=3e-5)
        without.append(np.abs(taken.actions(rows) - expected).max())
    assert max(without) > 1e-3, "what it remembers matters"


def test_a_recurrent_policy_is_a_folder_like_any_other_and_runs_compiled_in_a_controller(tmp_path):
    """One period at a time in Python, its network asked at every tenth, and compiled: the same bits; and it is exported."""
    residual = ResidualSettings("backstepping-force-first")
    model, _ = made(MEMORY, residual, randomize=True)
    model.learn(300)
    with torch.no_grad():
        model.policy.action_net.weight.mul_(0.5 / model.policy.action_net.weight.norm(dim=1).max())
    trained = Policy(network_of(model.algorithm, model.policy), CIRCLE, residual, {})
    save_policy(trained, tmp_path)
    compiled = ResidualController(None, tmp_path)
    function = ResidualController(None, read_policy(tmp_path).network.acting(), residual)
    assert (compiled.is_compiled(), function.is_compiled()) == (True, False)
    runs = [evaluate("BirthSIM/Circle-v2", one, "", 2, 5, duration=1.5) for one in (compiled, function, compiled)]
    said = {json.dumps({name: list(values) for name, values in one.metrics.items()}) for one in runs}
    assert len(said) == 1, "and an episode begins with an empty memory"
    assert export_onnx(trained, tmp_path / "policy.onnx").observations > 0


def test_sequences_that_begin_midway_are_learned_from_as_they_were_collected():
    """The buffer cuts what was collected where episodes begin: the policy then says again what it said step by step."""
    model, native = made(replace(MEMORY, lanes=3, rollout=64, batch=77), duration=0.3)
    model.learn(64 * 3 * 2)
    assert native.steps < 64, "episodes begin inside a rollout"
    buffer, compared = model.rollout_buffer, 0
    model.train = lambda: None
    model.learn(64 * 3, reset_num_timesteps=False)
    for batch in buffer.get(77):
        values, said, _ = model.policy.evaluate_actions(
            batch.observations, batch.actions, batch.lstm_states, batch.episode_starts
        )
        counted = batch.mask > 0
        torch.testing.assert_close(said[counted], batch.old_log_prob[counted], rtol=0, atol=1e-4)
        torch.testing.assert_close(values.flatten()[counted], batch.old_values[counted], rtol=0, atol=1e-4)
        compared += int(counted.sum())
    assert compared == 64 * 3


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_the_average_forgets_over_a_twentieth_of_the_training(algorithm):
    """One parameter steps from 0 to 1: what the average has taken up after a fraction of the steps is an exponential's."""
    between = 8 * (32 if algorithm == "ppo" else 1)
    model = made(replace(TINY, algorithm=algorithm, steps=20 * 25 * between))[0]
    first, averaged = (next(iter(policy.parameters())) for policy in (model.policy, model.average.module))
    with torch.no_grad():
        first.zero_()
        model.average.update_parameters(model.policy)
        first.fill_(1.0)
    for _ in range(25):
        model.average.update_parameters(model.policy)
    np.testing.assert_allclose(averaged.detach().numpy(), 1 - (1 - 1 / 25) ** 25, rtol=1e-5)


def test_distributions_are_checked_again_after_a_training():
    nothing = torch.tensor([math.nan])
    with unchecked_distributions():
        torch.distributions.Normal(nothing, torch.ones(1))
    with pytest.raises(ValueError, match="parameter loc"):
        torch.distributions.Normal(nothing, torch.ones(1))
