"""Trainings that are killed: what a checkpoint brings back, what it refuses, and that nothing in it is unpickled."""

from __future__ import annotations

import json
import pickle
import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize

from agents.policy.files import load_policy
from agents.residual.settings import ResidualSettings
from agents.training import monitor
from agents.training import trainer as training
from agents.training.algorithms import make_model, network_of
from agents.training.checkpoint import NAME, load_checkpoint, save_checkpoint
from agents.training.configuration import TrainingSettings
from agents.training.sb3_adapter import SB3VecEnv
from agents.training.trainer import train
from birthsim_env import Parameters
from tests.console import COMMANDS, PATIENCE, ROOT, call

PROBE = "BirthSIM/ProbeResidual-v1"
RESIDUAL = ResidualSettings()
TINY = TrainingSettings(
    PROBE, steps=1024, lanes=8, rollout=16, batch=64, epochs=1, gradient_steps=1, hidden=(8, 8),
    validation_lanes=2, validations=4,
)  # fmt: skip
SETTINGS, PAST = {"seed": 3, "hidden": [8, 8]}, {"law": {"pooled_mm": 2.5}, "policy": None, "curve": [{"steps": 0, "x": 0.1}]}


@pytest.fixture
def brief(monkeypatch):
    """Episodes of half a second; yields the seeds with which the training environments started their lanes."""
    make_vec, seeds = gymnasium.make_vec, []

    def made(name, num_envs, **arguments):
        env = make_vec(name, num_envs=num_envs, **{"duration": 0.5, **arguments})
        if num_envs == TINY.lanes:
            reset = env.reset
            env.reset = lambda seed=None, **options: (seeds.append(seed), reset(seed=seed, **options))[1]
        return env

    monkeypatch.setattr(training.gymnasium, "make_vec", made)
    return seeds


def new(algorithm="ppo", seed=0):
    """A model and its normalised environment that have seen nothing yet."""
    torch.set_num_threads(1)
    arguments = {"duration": 0.5, "randomize": True, "autoreset_mode": "SameStep"}
    env = VecNormalize(SB3VecEnv(gymnasium.make_vec(PROBE, num_envs=TINY.lanes, **arguments)))
    return make_model(replace(TINY, algorithm=algorithm, seed=seed), env), env


def learned(algorithm="ppo", steps=300):
    model, env = new(algorithm)
    model.learn(steps)
    return model, env


def tensors(content, where=""):
    """Every tensor and number in nested dictionaries and lists, by its place."""
    if isinstance(content, dict):
        return {place: leaf for key, value in content.items() for place, leaf in tensors(value, f"{where}/{key}").items()}
    if isinstance(content, (list, tuple)):
        return {place: leaf for k, value in enumerate(content) for place, leaf in tensors(value, f"{where}/{k}").items()}
    return {where: content}


def assert_same(one, other):
    mine, its = tensors(one), tensors(other)
    assert mine.keys() == its.keys()
    for place, leaf in mine.items():
        assert torch.equal(torch.as_tensor(leaf), torch.as_tensor(its[place])) if leaf is not None else its[place] is None, (
            place
        )


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "tqc"])
def test_a_checkpoint_brings_model_optimizers_and_normalisation_back_to_the_bit(tmp_path, algorithm):
    model, env = learned(algorithm)
    for _ in range(2):
        model.average.update_parameters(model.policy)
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    assert sorted(path.name for path in tmp_path.iterdir()) == [NAME]
    state = torch.get_rng_state()
    other, its = new(algorithm, seed=9)
    assert load_checkpoint(tmp_path, other, its, dict(SETTINGS)) == PAST
    assert torch.equal(torch.get_rng_state(), state)
    assert other.num_timesteps == model.num_timesteps >= 300
    assert other._n_updates == model._n_updates > 0
    assert_same(model.get_parameters(), other.get_parameters())
    assert_same(model.average.state_dict(), other.average.state_dict())
    for name in ("obs_rms", "ret_rms"):
        one, two = getattr(env, name), getattr(its, name)
        np.testing.assert_array_equal(one.mean, two.mean)
        np.testing.assert_array_equal(one.var, two.var)
        assert one.count == pytest.approx(two.count, rel=1e-6)
    seen = np.random.default_rng(0).normal(size=(40, env.observation_space.shape[0])).astype(np.float32)
    np.testing.assert_array_equal(network_of(model.policy, env).actions(seen), network_of(other.policy, its).actions(seen))
    # It is a copy: what goes on does not change what was kept.
    other.learn(64, reset_num_timesteps=False)
    assert not np.array_equal(network_of(model.policy, env).mean, network_of(other.policy, its).mean)


@pytest.mark.parametrize("algorithm", ["sac", "tqc"])
def test_a_checkpoint_brings_back_how_much_entropy_is_worth(tmp_path, algorithm):
    model, env = learned(algorithm)
    with torch.no_grad():
        model.log_ent_coef.fill_(-3.0)
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    other, its = new(algorithm)
    load_checkpoint(tmp_path, other, its, SETTINGS)
    assert float(other.log_ent_coef.detach()) == -3.0


def test_without_a_checkpoint_there_is_no_past(tmp_path):
    model, env = new()
    before = model.get_parameters()
    assert load_checkpoint(tmp_path, model, env, SETTINGS) is None
    assert_same(model.get_parameters(), before)
    assert model.num_timesteps == 0


def test_writing_again_replaces_it_whole_or_not_at_all(tmp_path, monkeypatch):
    model, env = new()
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    save_checkpoint(tmp_path, model, env, SETTINGS, {"curve": []})
    assert load_checkpoint(tmp_path, model, env, SETTINGS) == {"curve": []}

    def cut(content, file):
        file.write(b"half a checkp")
        raise KeyboardInterrupt

    monkeypatch.setattr(torch, "save", cut)
    with pytest.raises(KeyboardInterrupt):
        save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    assert load_checkpoint(tmp_path, model, env, SETTINGS) == {"curve": []}


@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"seed": 4, "hidden": [8, 8]}, "seed"),
        ({"seed": 3, "hidden": [8]}, "hidden"),
        ({"seed": 3}, "hidden"),
        ({**SETTINGS, "law": "none", "authority": 3.0}, "authority, law"),
    ],
)
def test_a_checkpoint_of_other_settings_is_refused_and_says_which(tmp_path, other, named):
    model, env = new()
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    with pytest.raises(ValueError, match=rf"is of a training with other {named}; allowed: the same settings") as caught:
        load_checkpoint(tmp_path, model, env, other)
    assert repr(str(tmp_path / NAME)) in str(caught.value)


def test_tuples_are_what_json_makes_of_them(tmp_path):
    model, env = new()
    save_checkpoint(tmp_path, model, env, {"hidden": (8, 8)}, PAST)
    assert load_checkpoint(tmp_path, model, env, {"hidden": [8, 8]}) == load_checkpoint(
        tmp_path, model, env, {"hidden": (8, 8)}
    )


class Trap:
    """Unpickling one writes a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (Path.touch, (self.path,))


def assert_damaged(folder, model, env):
    with pytest.raises(ValueError, match=r"(?s)is damaged.*; allowed: a checkpoint that birthsim-train wrote$") as caught:
        load_checkpoint(folder, model, env, SETTINGS)
    assert repr(str(folder / NAME)) in str(caught.value)
    return str(caught.value)


def test_a_damaged_checkpoint_is_refused_and_nothing_is_unpickled(tmp_path):
    model, env = new()
    path, trap = tmp_path / NAME, tmp_path / "sprung"
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    content = path.read_bytes()
    wrong = [b"", b"no checkpoint", content[:1000], content[: len(content) // 2], content[:-10], pickle.dumps(Trap(trap))]
    for damaged in wrong:
        path.write_bytes(damaged)
        assert_damaged(tmp_path, model, env)
    # A trap where a tensor should be, in PyTorch's own format.
    torch.save({"parameters": Trap(trap), "settings": json.dumps(SETTINGS)}, path)
    assert_damaged(tmp_path, model, env)
    assert not trap.exists()
    torch.load(path, weights_only=False)
    assert trap.exists(), "the trap is a real one"


def test_a_refusal_is_one_line_and_does_not_advise_to_unpickle(tmp_path):
    model, env = new()
    (tmp_path / NAME).write_bytes(pickle.dumps(Trap(tmp_path / "sprung")))
    said = assert_damaged(tmp_path, model, env)
    assert "\n" not in said
    assert "weights_only" not in said


@pytest.mark.parametrize("content", [[1, 2], 3, {}, {"settings": "{"}, {"settings": 3}])
def test_what_is_no_checkpoint_in_the_right_format_is_refused(tmp_path, content):
    model, env = new()
    torch.save(content, tmp_path / NAME)
    assert_damaged(tmp_path, model, env)


@pytest.mark.parametrize("missing", ["parameters", "steps", "observations", "past", "random"])
def test_a_checkpoint_that_lacks_a_part_is_called_damaged(tmp_path, missing):
    model, env = new()
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    content = torch.load(tmp_path / NAME, weights_only=True)
    del content[missing]
    torch.save(content, tmp_path / NAME)
    try:
        load_checkpoint(tmp_path, model, env, SETTINGS)
    except ValueError as error:
        if "is damaged" not in str(error):
            raise


def steps_of(reached):
    return [point["steps"] for point in reached["curve"]]


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_a_training_that_dies_goes_on_from_its_last_checkpoint(tmp_path, monkeypatch, brief, algorithm):
    """It dies 1.6 intervals on: what it had learned up to the last validation is there, what came after is learned anew."""
    settings, died = replace(TINY, algorithm=algorithm), 3 * 256 - 100
    models = []

    def die(self):
        if self.num_timesteps >= died:
            raise RuntimeError("out of memory")
        return True

    def made(*args):
        models.append(make_model(*args))
        return models[-1]

    monkeypatch.setattr(training, "make_model", made)
    with monkeypatch.context() as patch:
        patch.setattr(monitor.Monitor, "_on_step", die)
        with pytest.raises(RuntimeError, match="out of memory"):
            train(settings, RESIDUAL, tmp_path)
    content = torch.load(tmp_path / NAME, weights_only=True)
    kept, past = content["steps"], json.loads(content["past"])
    assert kept == past["curve"][-1]["steps"] == 512
    assert died - kept <= settings.steps / settings.validations, "at most one interval is lost"
    load_policy(tmp_path)
    reached = train(settings, RESIDUAL, tmp_path, resume=True)
    # The curve is the one so far, and goes on to the end.
    assert reached["curve"][:3] == past["curve"]
    assert steps_of(reached) == [0, 256, 512, 768, 1024]
    assert reached["law"] == past["law"]
    assert all(later["seconds"] > sooner["seconds"] for sooner, later in pairwise(reached["curve"]))
    second = models[1]
    assert second.num_timesteps == 1024
    assert second._n_updates > content["updates"] > 0
    # The learning rate has gone on falling over the whole training, to a tenth.
    assert second._total_timesteps == 1024
    assert second.lr_schedule(second._current_progress_remaining) < 0.35 * TINY.learning_rate
    # The second part met other worlds than the first.
    before, after = (set(seeds) for seeds in brief if seeds is not None)
    assert not before & after
    # A training that is over is not trained any further.
    weights = (tmp_path / "policy.safetensors").read_bytes()
    again = train(settings, RESIDUAL, tmp_path, resume=True)
    assert steps_of(again) == steps_of(reached)
    assert models[2].num_timesteps == 1024
    assert (tmp_path / "policy.safetensors").read_bytes() == weights


def test_what_goes_on_begins_with_what_was_learned(tmp_path, monkeypatch, brief):
    """Killed right after its checkpoint, a training validates the same policy as at that moment."""
    networks, take = [], monitor.network_of
    monkeypatch.setattr(monitor, "network_of", lambda *args: (networks.append(take(*args)), networks[-1])[1])

    def die(self):
        if self.num_timesteps > 512:
            raise RuntimeError

    with monkeypatch.context() as patch:
        patch.setattr(monitor.Monitor, "_on_rollout_end", die)
        with pytest.raises(RuntimeError):
            train(TINY, RESIDUAL, tmp_path)
    model, env = new()
    load_checkpoint(tmp_path, model, env, monitor.described(TINY, RESIDUAL, Parameters()))
    seen = np.random.default_rng(0).normal(size=(40, env.observation_space.shape[0])).astype(np.float32)
    np.testing.assert_array_equal(network_of(model.average.module, env).actions(seen), networks[-1].actions(seen))
    assert np.abs(networks[-1].actions(seen)).max() > 0


def test_resuming_without_a_checkpoint_begins(tmp_path, brief):
    one = train(replace(TINY, steps=128, validations=1), RESIDUAL, tmp_path / "one", resume=True)
    assert steps_of(one) == [0, 128]


@pytest.mark.parametrize(
    ("settings", "residual", "named"),
    [
        (replace(TINY, seed=1), RESIDUAL, "seed"),
        (replace(TINY, steps=4096, batch=32), RESIDUAL, "batch, steps"),
        (TINY, ResidualSettings(authority=50.0), "authority"),
        (TINY, RESIDUAL, "rig"),
    ],
)
def test_a_training_with_other_settings_or_another_rig_does_not_go_on(tmp_path, brief, settings, residual, named):
    model, env = new()
    save_checkpoint(tmp_path, model, env, monitor.described(TINY, RESIDUAL, Parameters()), PAST)
    before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    rig = Parameters().replace({"mechanics.mass": 4.5}) if named == "rig" else Parameters()
    with pytest.raises(ValueError, match=rf"is of a training with other {named}; allowed: the same settings"):
        train(settings, residual, tmp_path, rig, resume=True)
    assert {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before


CONFIGURATION = """[training]
environment = "BirthSIM/ProbeResidual-v1"
steps = 4096
lanes = 8
rollout = 32
batch = 64
epochs = 1
hidden = [8, 8]
validation_lanes = 2
validations = 8
"""


@pytest.mark.slow
def test_a_process_that_is_killed_loses_at_most_one_interval(tmp_path, monkeypatch, capsys):
    """SIGKILL, which no handler sees, at any moment after a checkpoint of 1024 steps; then the same command with --resume."""
    (tmp_path / "tiny.toml").write_text(CONFIGURATION)
    options = ("--config", tmp_path / "tiny.toml", "--out", tmp_path / "out")
    path = tmp_path / "out" / "seed_0" / NAME

    def steps():
        return torch.load(path, weights_only=True)["steps"] if path.is_file() else 0

    line = [sys.executable, "-m", COMMANDS["train"], *map(str, options)]
    with subprocess.Popen(line, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            until = time.monotonic() + PATIENCE
            while steps() < 1024 and process.poll() is None and time.monotonic() < until:
                time.sleep(0.01)
        finally:
            process.kill()
    assert process.returncode == -signal.SIGKILL
    assert not (path.parent / "training.json").exists()
    content = torch.load(path, weights_only=True)
    assert 1024 <= content["steps"] < 4096
    load_policy(path.parent)
    status, _, complained = call("train", monkeypatch, capsys, *options)
    assert status == 2
    assert "holds a training; allowed: --resume to go on, or another --out" in complained
    status, _, complained = call("train", monkeypatch, capsys, *options, "--resume")
    assert status == 0, complained
    reached = json.loads((path.parent / "training.json").read_text())
    assert reached["curve"][: len(json.loads(content["past"])["curve"])] == json.loads(content["past"])["curve"]
    assert steps_of(reached)[-1] == 4096
    assert len(reached["curve"]) >= 9
    assert all(later > sooner for sooner, later in pairwise(steps_of(reached)))
