"""A checkpoint: what it brings back, what it refuses, and that nothing in it is unpickled."""

import contextlib
import os
import pickle
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize

from agents.policy.sealed import sealed, unsealed
from agents.residual.settings import ResidualSettings
from agents.training.algorithms import make_model, network_of
from agents.training.checkpoint import FORMAT, NAME, load_checkpoint, save_checkpoint
from agents.training.reached import described
from agents.training.sb3_adapter import SB3VecEnv
from agents.training.trainer import train
from birthsim_env import Parameters
from tests.residual.policies import Trap
from tests.training.brief import TINY

PROBE = "BirthSIM/ProbeResidual-v2"
RESIDUAL = ResidualSettings()
SETTINGS, PAST = {"seed": 3, "hidden": [8, 8]}, {"reached": {"policy": None, "curve": [{"steps": 0, "x": 0.1}]}, "due": 256.0}


def new(algorithm="ppo", seed=0):
    """A model that has seen nothing yet, and its normalised environment."""
    torch.set_num_threads(1)
    arguments = {"duration": 0.5, "randomize": True, "autoreset_mode": "SameStep"}
    env = VecNormalize(SB3VecEnv(gymnasium.make_vec(PROBE, num_envs=TINY.lanes, **arguments)))
    env.seed(seed)
    env.reset()
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

    def cut(number):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", cut)
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


def assert_damaged(folder, model, env, words="(no birthsim-checkpoint-1 or )?damaged"):
    with pytest.raises(ValueError, match=f"(?s) is {words}.*; allowed: a checkpoint that birthsim train wrote$") as caught:
        load_checkpoint(folder, model, env, SETTINGS)
    assert repr(str(folder / NAME)) in str(caught.value)
    return str(caught.value)


def test_a_damaged_checkpoint_is_refused_and_nothing_is_unpickled(tmp_path):
    model, env = new()
    path, trap = tmp_path / NAME, tmp_path / "sprung"
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    content = path.read_bytes()
    wrong = [b"", b"no checkpoint", content[:1000], content[: len(content) // 2], content[:-10], pickle.dumps(Trap(trap))]
    # Every bit of such a file counts: tests/residual/test_policy_damage.py.
    for damaged in [*wrong, content[:-1] + bytes([content[-1] ^ 1])]:
        path.write_bytes(damaged)
        assert_damaged(tmp_path, model, env)
    assert not trap.exists()
    pickle.loads(pickle.dumps(Trap(trap)))
    assert trap.exists(), "the trap is a real one"


def rewritten(folder, change):
    """The checkpoint with what ``change`` does to its JSON and its arrays, and a checksum that vouches for it."""
    arrays, about = unsealed((folder / NAME).read_bytes(), FORMAT)
    change(about, arrays)
    (folder / NAME).write_bytes(sealed(arrays, about))


@pytest.mark.parametrize("missing", ["past", "parameters", "average", "counts", "observations", "last", "lanes", "random"])
def test_a_checkpoint_of_another_version_is_refused(tmp_path, missing):
    model, env = new()
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)

    def leave_out(about, _):
        about["content"]["dict"] = [pair for pair in about["content"]["dict"] if pair[0] != missing]

    rewritten(tmp_path, leave_out)
    with pytest.raises(ValueError, match=r"does not fit this version \(.*\); allowed: a checkpoint that") as caught:
        load_checkpoint(tmp_path, model, env, SETTINGS)
    assert repr(str(tmp_path / NAME)) in str(caught.value)


def test_whatever_an_intact_checkpoint_lacks_is_a_value_error(tmp_path):
    """Every array left out, cut to nothing, and given as text."""
    model, env = learned("sac", 100)
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    whole = (tmp_path / NAME).read_bytes()
    names = sorted(unsealed(whole, FORMAT)[0])
    for name in names[:: len(names) // 12]:
        for instead in (None, np.zeros((0, 0, 0)), np.frombuffer(b"text", np.uint8)):

            def change(_, arrays, name=name, instead=instead):
                del arrays[name]
                if instead is not None:
                    arrays[name] = instead

            (tmp_path / NAME).write_bytes(whole)
            rewritten(tmp_path, change)
            with contextlib.suppress(ValueError):
                load_checkpoint(tmp_path, model, env, SETTINGS)
    for content in ([1, 2], 3, {}, "text", None, {"dict": 3}, {"dict": [[1]]}, {"array": "none"}):
        (tmp_path / NAME).write_bytes(whole)
        rewritten(tmp_path, lambda about, _, content=content: about.update(content=content))
        with pytest.raises(ValueError, match="does not fit this version"):
            load_checkpoint(tmp_path, model, env, SETTINGS)
    for settings in ([1, 2], 3, None, "text"):
        (tmp_path / NAME).write_bytes(whole)
        rewritten(tmp_path, lambda about, _, settings=settings: about.update(settings=settings))
        with pytest.raises(ValueError, match="allowed: "):
            load_checkpoint(tmp_path, model, env, SETTINGS)


@pytest.mark.parametrize(
    ("settings", "residual", "named"),
    [
        (replace(TINY, seed=1), RESIDUAL, "seed"),
        (replace(TINY, steps=4096, batch=32), RESIDUAL, "batch, steps"),
        (TINY, ResidualSettings(authority=50.0), "authority"),
        (TINY, RESIDUAL, "rig"),
    ],
)
def test_a_training_with_other_settings_or_another_rig_does_not_go_on(tmp_path, short_probe, settings, residual, named):
    model, env = new()
    save_checkpoint(tmp_path, model, env, described(TINY, RESIDUAL, Parameters()), PAST)
    before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    rig = Parameters().replace({"mechanics.mass": 4.5}) if named == "rig" else Parameters()
    with pytest.raises(ValueError, match=rf"is of a training with other {named}; allowed: the same settings"):
        train(settings, residual, tmp_path, rig)
    assert {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before
