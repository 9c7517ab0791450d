"""A checkpoint: what it refuses, and that nothing in it is unpickled. What it brings back: ``test_kills``."""

import contextlib
import json
import pickle
import re
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize

from agents.policy.sealed import sealed, unsealed
from agents.residual.settings import ResidualSettings
from agents.training.checkpoint import FORMAT, NAME
from agents.training.configuration import algorithm_of, override
from agents.training.reached import described
from agents.training.sb3.adapter import SB3VecEnv
from agents.training.sb3.checkpoint import load_checkpoint, save_checkpoint
from agents.training.sb3.model import make_model
from agents.training.trainer import train
from birthsim_env import Parameters
from tests.residual.policies import Trap
from tests.training.brief import TINY

PROBE = "BirthSIM/ProbeResidual-v3"
RESIDUAL = ResidualSettings()
SETTINGS, PAST = {"seed": 3, "hidden": [8, 8]}, {"reached": {"policy": None, "curve": [{"steps": 0, "x": 0.1}]}, "due": 256.0}


def new(algorithm="ppo", seed=0):
    """A model that has seen nothing yet, and its normalised environment."""
    torch.set_num_threads(1)
    arguments = {"duration": 0.5, "randomize": True, "autoreset_mode": "SameStep"}
    env = VecNormalize(SB3VecEnv(gymnasium.make_vec(PROBE, num_envs=TINY.lanes, **arguments)))
    env.seed(seed)
    env.reset()
    settings = override(TINY, algorithm=algorithm, seed=seed)
    return make_model(algorithm_of(algorithm), settings, env), env


def test_a_damaged_checkpoint_is_refused_and_nothing_is_unpickled(tmp_path):
    model, env = new()
    path, trap = tmp_path / NAME, tmp_path / "sprung"
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    content = path.read_bytes()
    wrong = [b"", b"no checkpoint", content[:1000], content[: len(content) // 2], content[:-10], pickle.dumps(Trap(trap))]
    # Every bit of such a file counts: tests/residual/test_policy_damage.py.
    for damaged in [*wrong, content[:-1] + bytes([content[-1] ^ 1])]:
        path.write_bytes(damaged)
        match = rf"(?s) is (no {FORMAT} or )?damaged.*; allowed: a checkpoint that birthsim train wrote$"
        with pytest.raises(ValueError, match=match) as caught:
            load_checkpoint(tmp_path, model, env, SETTINGS)
        assert repr(str(path)) in str(caught.value)
    assert not trap.exists()
    pickle.loads(pickle.dumps(Trap(trap)))
    assert trap.exists(), "the trap is a real one"


def test_an_intact_checkpoint_that_does_not_fit_is_a_value_error(tmp_path):
    """Every part of its content left out, or another content; every array left out, cut to nothing, and given as text."""
    model, env = new("sac")
    model.learn(100)
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    arrays, about = unsealed((tmp_path / NAME).read_bytes(), FORMAT)

    def loaded(arrays, **changes):
        """With a checksum that vouches for it."""
        (tmp_path / NAME).write_bytes(sealed(arrays, {**about, **changes}))
        load_checkpoint(tmp_path, model, env, SETTINGS)

    pairs = about["content"]["dict"]
    shorter = [{"dict": [pair for pair in pairs if pair is not one]} for one in pairs]
    for content in (*shorter, [1, 2], 3, {}, "text", None, {"dict": 3}, {"dict": [[1]]}, {"array": "none"}):
        with pytest.raises(ValueError, match=r"does not fit this version \(.*\); allowed: a checkpoint that") as caught:
            loaded(arrays, content=content)
        assert repr(str(tmp_path / NAME)) in str(caught.value)
    for settings in ([1, 2], 3, None, "text"):
        with pytest.raises(ValueError, match="allowed: "):
            loaded(arrays, settings=settings)
    for name in sorted(arrays)[:: len(arrays) // 12]:
        for instead in ({}, {name: np.zeros((0, 0, 0))}, {name: np.frombuffer(b"text", np.uint8)}):
            with contextlib.suppress(ValueError):
                loaded({**{key: array for key, array in arrays.items() if key != name}, **instead})


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


def _told(model, env):
    """What the next steps of a training depend on, besides its lanes."""
    random = np.random.get_state(legacy=False)["state"]["key"].tolist(), torch.get_rng_state().tolist()  # noqa: NPY002
    weights = [weight.detach().numpy().tolist() for weight in model.policy.parameters()]
    return weights, random, env.returns.tolist(), env.obs_rms.mean.tolist(), model.num_timesteps


@pytest.mark.parametrize("algorithm", ["sac", "ppo"])
def test_no_number_that_is_read_is_beyond_what_it_indexes_and_a_refusal_changes_nothing(tmp_path, algorithm):
    """NumPy reads wherever its generator is said to stand; PyTorch takes moments of any shape, a buffer any position."""
    model, env = new(algorithm)
    model.learn(100)
    save_checkpoint(tmp_path, model, env, SETTINGS, PAST)
    arrays, about = unsealed((tmp_path / NAME).read_bytes(), FORMAT)
    other, world = new(algorithm, seed=1)
    before, text = _told(other, world), json.dumps(about["content"])

    def loaded(arrays, content):
        (tmp_path / NAME).write_bytes(sealed(arrays, {**about, "content": json.loads(content)}))
        return load_checkpoint(tmp_path, other, world, SETTINGS)

    wrong = [
        (arrays, re.sub(r'\["pos", \d+\]\]\}\], \["has_gauss"', '["pos", 1000000]]}], ["has_gauss"', text)),
        ({**arrays, "/returns": np.zeros(3)}, text),
        ({**arrays, "/returns": np.full(TINY.lanes, np.nan)}, text),
        ({**arrays, "/last/0": np.zeros((2, 2), np.float32)}, text),
        ({**arrays, "/lanes/episodes.elapsed": np.full(TINY.lanes, -1)}, text),
        ({**arrays, "/lanes/lengths": np.full(TINY.lanes, -1)}, text),
    ]
    if algorithm == "ppo":
        moments = next(name for name in arrays if name.endswith("exp_avg"))
        wrong.append(({**arrays, moments: np.zeros((3, 3), np.float32)}, text))
    else:
        wrong += [(arrays, text.replace('["pos", 13]', f'["pos", {pos}]')) for pos in (10**9, -1)]
    assert sum(changed != text for _, changed in wrong) == len(wrong) - 5 - (algorithm == "ppo"), "places were found"
    for content in wrong:
        with pytest.raises(ValueError, match=r"does not fit this version .*; allowed: a checkpoint that"):
            loaded(*content)
        assert _told(other, world) == before
    assert loaded(arrays, text) == PAST
    assert _told(other, world)[0] == _told(model, env)[0]
