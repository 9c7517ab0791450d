"""Configurations of trainings: those that come with the package, one's own, and what is unknown or impossible by name."""

from __future__ import annotations

import json
import tomllib
from dataclasses import fields

import gymnasium
import pytest
import torch
import yaml

import agents
from agents.residual.settings import ResidualSettings
from agents.training.configuration import FOLDER, TrainingSettings, configuration_names, load_configuration, override
from birthsim_env.parts.scenarios import SCENARIOS, environment_id

assert agents  # importing it registers the ids


def test_there_is_a_configuration_for_every_scenario():
    assert set(SCENARIOS) <= set(configuration_names())
    for name in SCENARIOS:
        assert load_configuration(name)[0].environment == environment_id(name, "Residual")


@pytest.mark.parametrize("name", configuration_names())
def test_every_configuration_of_the_package_says_what_its_file_says_and_can_be_made(name):
    training, residual = load_configuration(name)
    content = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    assert content["training"].keys() <= {field.name for field in fields(TrainingSettings)}
    for table, settings in (("training", training), ("residual", residual)):
        for key, value in content.get(table, {}).items():
            assert settings.to_dict()[key] == value
        for key, value in type(settings)().to_dict().items():
            assert key in content.get(table, {}) or settings.to_dict()[key] == value, "what is not said is the default"
    arguments = {"sensors": training.sensors, "randomize": training.randomize, **residual.to_dict()}
    env = gymnasium.make_vec(training.environment, num_envs=1, **arguments)
    assert env.single_action_space.shape == (residual.size,)
    # PPO's minibatches are whole parts of what it collects.
    assert training.lanes * training.rollout % training.batch == 0
    assert json.loads(json.dumps(training.to_dict())) == training.to_dict()


def written(folder, text):
    path = folder / "own.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_of_ones_own_says_only_what_differs(tmp_path):
    path = written(
        tmp_path,
        '[training]\nalgorithm = "sac"\nhidden = [32, 16]\nrandomize = "plant"\nlearning_rate = 3e-4\n'
        '[residual]\nimpedance = "variable"\nauthority = 60\n',
    )
    training, residual = load_configuration(path)
    assert (training, residual) == load_configuration(str(path))
    assert training == TrainingSettings(algorithm="sac", hidden=(32, 16), randomize="plant", learning_rate=3e-4)
    assert residual == ResidualSettings(impedance="variable", authority=60)
    assert load_configuration(written(tmp_path, "")) == (TrainingSettings(), ResidualSettings())
    # A file called like a configuration of the package is reached by its path.
    (tmp_path / "probe.toml").write_text("[training]\nsteps = 7\n")
    assert load_configuration(tmp_path / "probe.toml")[0].steps == 7
    assert load_configuration("probe")[0].steps != 7


REFUSED = [
    ("[experiment]\nsteps = 3", "table 'experiment'; allowed: training, residual"),
    ("steps = 3", "table 'steps'; allowed: training, residual"),
    ("[training]\nstep = 3", "step = 3 is unknown; allowed: environment, algorithm, steps, "),
    ("[training]\nlaw = 'none'", "law = 'none' is unknown; allowed: environment, "),
    ("[residual]\nsmoothing = 0.3", "smoothing = 0.3 is unknown; allowed: law, impedance, authority, "),
    ("[residual]\nweight_compensation = true", "weight_compensation = True is unknown; allowed: law, "),
    ("[training]\nalgorithm = 'dqn'", "algorithm = 'dqn'; allowed: 'ppo', 'sac', 'tqc'"),
    ("[training]\nsteps = 0", "steps = 0; allowed: a whole number >= "),
    ("[training]\nsteps = -5", "steps = -5; allowed: a whole number >= "),
    ("[training]\nsteps = 1e6", "steps = 1000000.0; allowed: a whole number >= "),
    ("[training]\nlanes = true", "lanes = True; allowed: a whole number >= "),
    ("[training]\nrollout = '64'", "rollout = '64'; allowed: a whole number >= "),
    ("[training]\nbatch = 2.5", "batch = 2.5; allowed: a whole number >= "),
    ("[training]\nbatch = 1", "batch = 1; allowed: a whole number >= 2 and <= 1048576"),
    ("[training]\nlanes = 65536\nrollout = 65536", "lanes = 65536 with rollout = 65536; allowed: a product of at most 4194304"),
    ("[training]\nepochs = 0", "epochs = 0; allowed: a whole number >= "),
    ("[training]\ngradient_steps = 0", "gradient_steps = 0; allowed: a whole number >= "),
    ("[training]\nvalidation_lanes = 0", "validation_lanes = 0; allowed: a whole number >= "),
    ("[training]\nvalidations = -1", "validations = -1; allowed: a whole number >= "),
    ("[training]\nlearning_rate = 0.0", "learning_rate = 0.0; allowed: a finite number > 0 and <= 1 (-)"),
    ("[training]\nlearning_rate = nan", "learning_rate = nan; allowed: a finite number > 0 and <= 1 (-)"),
    ("[training]\ndiscount = -0.5", "discount = -0.5; allowed: a finite number > 0 and <= 1 (-)"),
    ("[training]\ngae_lambda = 'a'", "gae_lambda = 'a'; allowed: a finite number > 0 and <= 1 (-)"),
    ("[training]\nhidden = []", "hidden = (); allowed: 1 to 8 whole numbers from 1 to 2048"),
    ("[training]\nhidden = [64, 0]", "hidden = (64, 0); allowed: 1 to 8 whole numbers from 1 to 2048"),
    ("[training]\nhidden = [64.5]", "hidden = (64.5,); allowed: 1 to 8 whole numbers from 1 to 2048"),
    ("[residual]\nlaw = 'pid'", "law = 'pid'; allowed: 'backstepping', "),
    ("[residual]\nimpedance = 'soft'", "impedance = 'soft'; allowed: 'fixed', 'variable_kp', 'variable'"),
    ("[residual]\nlaw = 'none'\nimpedance = 'variable'", "law = 'none' has no impedance to vary"),
    ("[residual]\nauthority = 501", "authority = 501; allowed: more than 0, at most 500"),
    ("[residual]\ntime_constant = 0", "time_constant = 0; allowed: more than 0, at most 1"),
    ("[training\nsteps = 3", "is no TOML: "),
    ("[training]\nsteps = 3\nsteps = 4", "is no TOML: "),
]


def assert_refused(path, message):
    with pytest.raises(ValueError, match=r"configuration ") as caught:
        load_configuration(path)
    assert repr(str(path)) in str(caught.value)
    assert message in str(caught.value)


@pytest.mark.parametrize(("text", "message"), REFUSED)
def test_what_is_unknown_or_cannot_be_is_refused_with_the_file_and_what_is_allowed(tmp_path, text, message):
    assert_refused(written(tmp_path, text), message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("training = 3", "training = 3"),
        ("[[training]]\nsteps = 3", "training = "),
        ("residual = [1]", "residual = [1]"),
        ("[training]\nhidden = 64", "hidden = 64"),
        ("[training]\nhidden = [true]", "hidden = (True,)"),
        ("[training]\nlog_std = 'low'", "log_std = 'low'"),
        ("[training]\nlog_std = nan", "log_std = nan"),
        ("[training]\nlearning_rate = inf", "learning_rate = inf"),
        ("[training]\ndiscount = 1.5", "discount = 1.5"),
        ("[training]\ngae_lambda = 2.0", "gae_lambda = 2.0"),
        ("[training]\nseed = -1", "seed = -1"),
        ("[training]\nseed = 'one'", "seed = 'one'"),
        ("[training]\nsensors = 'none'", "sensors = 'none'"),
        ("[training]\nrandomize = 'some'", "randomize = 'some'"),
        ("[training]\nenvironment = 3", "environment = 3"),
        ("[residual]\nauthority = true", "authority = True"),
    ],
)
def test_values_of_a_wrong_kind_are_refused_too(tmp_path, text, message):
    assert_refused(written(tmp_path, text), message)


@pytest.mark.parametrize("name", ["square", "circle.toml", "nowhere/circle", ""])
def test_a_configuration_that_is_not_there_is_refused_with_those_that_are(name):
    with pytest.raises(ValueError, match=r"is no file; allowed: circle, .*vacuum, or a TOML file") as caught:
        load_configuration(name)
    assert repr(name or ".") in str(caught.value) or repr(name) in str(caught.value)


def test_what_is_no_text_is_refused(tmp_path):
    path = tmp_path / "own.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="is no TOML: "):
        load_configuration(path)
    with pytest.raises(ValueError, match="is no file"):
        load_configuration(tmp_path)


def test_overriding_checks_names_and_values():
    settings = override(TrainingSettings(), steps=9, algorithm="tqc")
    assert (settings.steps, settings.algorithm) == (9, "tqc")
    assert override(settings) == settings
    with pytest.raises(ValueError, match=r"colour = 'red' is unknown; allowed: environment, "):
        override(settings, colour="red")
    with pytest.raises(ValueError, match=r"authority = 0; allowed: more than 0"):
        override(ResidualSettings(), authority=0)


RL_ZOO = yaml.safe_load((FOLDER / "rl_zoo_ppo.yml").read_text(encoding="utf-8"))


def test_rl_zoos_file_has_every_scenario():
    assert set(RL_ZOO) == {environment_id(name, "Residual") for name in SCENARIOS}


@pytest.mark.parametrize("name", sorted(SCENARIOS))
def test_rl_zoos_file_says_what_the_configuration_beside_it_says(name):
    training, residual = load_configuration(name)
    zoo = RL_ZOO[training.environment]
    numbers = {
        "n_envs": training.lanes, "n_timesteps": training.steps, "n_steps": training.rollout, "batch_size": training.batch,
        "n_epochs": training.epochs, "gamma": training.discount, "gae_lambda": training.gae_lambda,
        "learning_rate": f"lin_{training.learning_rate:g}",
    }  # fmt: skip
    assert {key: zoo[key] for key in numbers} == numbers
    assert zoo["normalize"] is True
    layers = list(training.hidden)
    policy = eval(zoo["policy_kwargs"], {"nn": torch.nn, "dict": dict})  # as RL-Zoo reads it
    assert policy == {
        "log_std_init": training.log_std, "activation_fn": torch.nn.Tanh, "net_arch": {"pi": layers, "vf": layers},
    }  # fmt: skip
    arguments = {"sensors": training.sensors, "randomize": training.randomize}
    assert zoo["env_kwargs"].items() <= {**residual.to_dict(), **arguments}.items()
    assert arguments.items() <= zoo["env_kwargs"].items()
    for key, value in residual.to_dict().items():
        assert zoo["env_kwargs"].get(key, getattr(ResidualSettings(), key)) == value
    env = gymnasium.make(training.environment, **zoo["env_kwargs"])
    assert env.action_space.shape == (residual.size,)
