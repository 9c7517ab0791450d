"""Configurations of trainings: those that come with the package, one's own, and ranges that reach further in training."""

import json
import tomllib
from dataclasses import fields

import gymnasium
import pytest
import torch
import yaml

from agents.residual.corrected import action_names
from agents.residual.settings import ResidualSettings
from agents.training.configuration import (
    FOLDER,
    TrainingSettings,
    algorithm_of,
    configuration_names,
    load_configuration,
    override,
)
from agents.training.margin import CALMING, EXCITING, widened
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.parts.scenarios import environment_id, studied_scenarios
from birthsim_env.physics.rig.parameters import Parameters

RL_ZOO = yaml.safe_load((FOLDER / "rl_zoo_ppo.yml").read_text(encoding="utf-8"))


def test_there_is_a_configuration_for_every_scenario_in_both_files():
    for name in studied_scenarios():
        assert load_configuration(name)[0].environment == environment_id(name, "Residual")
    assert set(RL_ZOO) == {environment_id(name, "Residual") for name in studied_scenarios()}


@pytest.mark.parametrize("name", configuration_names())
def test_every_configuration_of_the_package_says_what_its_file_says_and_can_be_made(name):
    training, residual = load_configuration(name)
    content = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    assert content["training"].keys() <= {field.name for field in fields(TrainingSettings)}
    for table, settings in (("training", training), ("residual", residual)):
        for key, value in content.get(table, {}).items():
            assert settings.to_dict()[key] == value
        plain = type(settings)(**({"algorithm": settings.algorithm} if table == "training" else {}))
        for key, value in plain.to_dict().items():
            assert key in content.get(table, {}) or settings.to_dict()[key] == value, "what is not said is the default"
    arguments = {"sensors": training.sensors, "randomize": training.randomize, **residual.to_dict()}
    env = gymnasium.make_vec(training.environment, num_envs=1, **arguments)
    assert env.single_action_space.shape == (len(action_names(residual, env.unwrapped.simulation.parameters)),)
    # Minibatches are whole parts of what is collected.
    assert "ppo" not in training.algorithm or training.lanes * training.rollout % training.batch == 0
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


def test_another_algorithm_brings_its_own_hyperparameters_and_leaves_what_a_configuration_says():
    lab, own = load_configuration("circle_lab")[0], algorithm_of("sac").defaults()
    changed = override(lab, algorithm="sac", batch=512)
    assert (changed.learning_rate, changed.batch) == (lab.learning_rate, 512), "said by the file, and by the call"
    assert (changed.lanes, changed.gradient_steps, changed.memory) == (own["lanes"], own["gradient_steps"], 0)
    assert own["lanes"] != lab.lanes
    assert override(changed, algorithm="recurrent-ppo").memory == algorithm_of("recurrent-ppo").defaults()["memory"] > 0
    assert override(lab, algorithm="ppo") == lab


@pytest.mark.parametrize("name", sorted(studied_scenarios()))
def test_rl_zoos_file_says_what_the_configuration_beside_it_says(name):
    training, residual = load_configuration(name)
    zoo = RL_ZOO[training.environment]
    numbers = {
        "n_envs": training.lanes, "n_timesteps": training.steps, "n_steps": training.rollout, "batch_size": training.batch,
        "n_epochs": training.epochs, "gamma": training.discount, "gae_lambda": training.gae_lambda,
        "learning_rate": f"lin_{training.learning_rate:g}",
    }  # fmt: skip
    assert {key: zoo[key] for key in numbers} == numbers
    assert "normalize" not in zoo, "as here: neither observations nor rewards"
    layers = list(training.hidden)
    policy = eval(zoo["policy_kwargs"], {"nn": torch.nn, "dict": dict})  # as RL-Zoo reads it
    assert policy == {
        "log_std_init": training.log_std,
        "activation_fn": torch.nn.Tanh,
        "net_arch": {"pi": layers, "vf": layers},
    }
    arguments = {"sensors": training.sensors, "randomize": training.randomize}
    assert zoo["env_kwargs"].items() <= {**residual.to_dict(), **arguments}.items()
    assert arguments.items() <= zoo["env_kwargs"].items()
    for key, value in residual.to_dict().items():
        assert zoo["env_kwargs"].get(key, getattr(ResidualSettings(), key)) == value
    env = gymnasium.make(training.environment, **zoo["env_kwargs"])
    assert env.action_space.shape == (residual.size,)


MASSES, SLOWEST = (2.0, 5.0), 0.008
"""kg; s: what ``Mechanics.mass`` and ``Valves.time_constant`` document."""


def test_ranges_reach_further_on_one_side_and_an_owners_own_count() -> None:
    known, wide = documented_ranges(Parameters()), documented_ranges(widened(Parameters(), 0.5))
    assert wide["mechanics.mass"] == pytest.approx((MASSES[0] / 1.5, MASSES[1]))
    assert wide["valves.time_constant"] == pytest.approx((0.0012, 1.5 * SLOWEST))
    assert {name for name in known if wide[name] != known[name]} == {*CALMING, EXCITING}
    rig = Parameters.from_dict({"randomize": {"mechanics.mass": [7.0, 10.0], "air.supply_pressure": [6e5, 7e5]}})
    ranges = documented_ranges(widened(rig, 0.25))
    assert ranges["mechanics.mass"] == (7.0 / 1.25, 10.0)
    assert ranges["air.supply_pressure"] == (6e5, 7e5)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"friction": "sticky"}, "friction = 'sticky'; allowed: '', 'lugre'"),
        ({"friction": "drawn", "randomize": "scenario"}, "with randomize = 'scenario'; allowed: randomize = True or 'plant'"),
        ({"friction": "gms", "algorithm": "apg"}, "friction = 'gms' with algorithm = 'apg', though gms has no gradients"),
        ({"friction": "drawn", "algorithm": "apg"}, r"allowed: 'lugre', .*'drawn-smooth'"),
    ],
)
def test_frictions_that_no_training_can_draw_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        TrainingSettings(**changes)
