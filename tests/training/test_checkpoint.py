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

from agents.policy.files import WEIGHTS
from agents.policy.sealed import sealed, unsealed
from agents.residual.settings import ResidualSettings
from agents.training.checkpoint import FORMAT, NAME, _nested, write_checkpoint
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
    """A model that has seen nothing yet."""
    torch.set_num_threads(1)
    arguments = {"duration": 0.5, "randomize": True, "autoreset_mode": "SameStep"}
    env = SB3VecEnv(gymnasium.make_vec(PROBE, num_envs=TINY.lanes, **arguments))
    env.seed(seed)
    env.reset()
    settings = override(TINY, algorithm=algorithm, seed=seed)
    return make_model(algorithm_of(algorithm), settings, env)


def test_a_damaged_checkpoint_is_refused_and_nothing_is_unpickled(tmp_path):
    model = new()
    path, trap = tmp_path / NAME, tmp_path / "sprung"
    save_checkpoint(tmp_path, model, SETTINGS, PAST)
    content = path.read_bytes()
    wrong = [b"", b"no checkpoint", content[:1000], content[: len(content) // 2], content[:-10], pickle.dumps(Trap(trap))]
    # Every bit of such a file counts: tests/residual/test_policy_damage.py.
    for damaged in [*wrong, content[:-1] + bytes([content[-1] ^ 1])]:
        path.write_bytes(damaged)
        match = rf"(?s) is (no {FORMAT} or )?damaged.*; allowed: a checkpoint that birthsim train wrote$"
        with pytest.raises(ValueError, match=match) as caught:
            load_checkpoint(tmp_path, model, SETTINGS)
        assert repr(str(path)) in str(caught.value)
    assert not trap.exists()
    pickle.loads(pickle.dumps(Trap(trap)))
    assert trap.exists(), "the trap is a real one"


def test_an_intact_checkpoint_that_does_not_fit_is_a_value_error(tmp_path):
    """Every part of its content left out, or another content; every array left out, cut to nothing, and given as text."""
    model = new("sac")
    model.learn(100)
    save_checkpoint(tmp_path, model, SETTINGS, PAST)
    arrays, about = unsealed((tmp_path / NAME).read_bytes(), FORMAT)

    def loaded(arrays, **changes):
        """With a checksum that vouches for it."""
        (tmp_path / NAME).write_bytes(sealed(arrays, {**about, **changes}))
        load_checkpoint(tmp_path, model, SETTINGS)

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
    model = new()
    save_checkpoint(tmp_path, model, described(TINY, RESIDUAL, Parameters()), PAST)
    before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    rig = Parameters().replace({"mechanics.mass": 4.5}) if named == "rig" else Parameters()
    with pytest.raises(ValueError, match=rf"is of a training with other {named}; allowed: the same settings"):
        train(settings, residual, tmp_path, rig)
    assert {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before


def _without(name):
    """Leaves out what stands at a place such as ``reached/law``."""

    def change(past):
        *places, last = name.split("/")
        for place in places:
            past = past[int(place) if place.isdigit() else place]
        del past[last]

    return change


def _set(name, value):
    def change(past):
        *places, last = name.split("/")
        for place in places:
            past = past[int(place) if place.isdigit() else place]
        past[last] = value

    return change


BROKEN_PASTS = {
    **{name: (_without(name), name.split("/")[-1]) for name in ("reached", "due", "best", "seconds", "events")},
    **{name: (_without(name), name.split("/")[-1]) for name in ("reached/law", "reached/policy", "reached/curve")},
    "a metric": (_without("reached/law/pooled_mm"), r"past\.reached\.law lacks 'pooled_mm'"),
    "a metric of the best": (_without("reached/policy/lost"), r"past\.reached\.policy lacks 'lost'"),
    "a point": (_without("reached/curve/0/steps"), r"past\.reached\.curve\[0\] lacks 'steps'"),
    "a text": (_set("seconds", "long"), r"past\.seconds = 'long'; allowed: a number"),
    "infinite": (_set("seconds", float("inf")), r"past\.seconds = inf; allowed: a number from 0"),
    "not a number": (_set("due", float("nan")), r"past\.due = nan; allowed: a number from 0 to 256"),
    "beyond the end": (_set("due", 1e9), r"past\.due = 1000000000\.0; allowed: a number from 0 to 256"),
    "a size": (_set("events", {"events.out.tfevents.1": -1}), r"past\.events.*= -1; allowed: 0 to"),
    "a law of words": (_set("reached/law", "good"), r"past\.reached\.law = 'good'; allowed: an object with pooled_mm"),
    "no policy": (_set("reached/policy", None), r"past\.reached\.policy is empty.*; allowed: all or none"),
    "another paper": (_set("reached/paper", {}), r"past\.reached\.paper"),
    "no bytes": (_set("best", [1, 2]), r"past\.best = \[1, 2\]; allowed: bytes"),
    "other bytes": (
        _set("best", np.arange(200, dtype=np.uint8)),
        r"past\.best is .*damaged.*; allowed: the content of",
    ),
}


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """The checkpoint of a training that has ended, with its settings."""
    folder, settings = tmp_path_factory.mktemp("past"), override(TINY, steps=256, validations=1)
    train(settings, ResidualSettings(policy_period=0.1), folder)
    return settings, folder


@pytest.mark.parametrize("case", BROKEN_PASTS)
def test_a_past_that_cannot_be_is_refused_by_name_before_anything_is_made_of_it(tmp_path, interrupted, case):
    settings, folder = interrupted
    change, named = BROKEN_PASTS[case]
    arrays, about = unsealed((folder / NAME).read_bytes(), FORMAT)
    content = _nested(about["content"], arrays)
    change(content["past"])
    write_checkpoint(tmp_path, about["settings"], content)
    before = (tmp_path / NAME).read_bytes()
    with pytest.raises(ValueError, match=rf"(?s)does not fit this version .*{named}.*; allowed: a checkpoint that") as caught:
        train(settings, ResidualSettings(policy_period=0.1), tmp_path)
    assert repr(str(tmp_path / NAME)) in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == [NAME]
    assert (tmp_path / NAME).read_bytes() == before


def test_the_past_of_a_whole_training_is_one(tmp_path, interrupted):
    settings, folder = interrupted
    arrays, about = unsealed((folder / NAME).read_bytes(), FORMAT)
    write_checkpoint(tmp_path, about["settings"], _nested(about["content"], arrays))
    found = train(settings, ResidualSettings(policy_period=0.1), tmp_path)
    assert [point["steps"] for point in found["curve"]] == [0, 256]
    assert (tmp_path / WEIGHTS).read_bytes() == (folder / WEIGHTS).read_bytes()


def _told(model):
    """What the next steps of a training depend on, besides its lanes."""
    random = np.random.get_state(legacy=False)["state"]["key"].tolist(), torch.get_rng_state().tolist()  # noqa: NPY002
    weights = [weight.detach().numpy().tolist() for weight in model.policy.parameters()]
    return weights, random, model.num_timesteps


@pytest.mark.parametrize("algorithm", ["sac", "ppo"])
def test_no_number_that_is_read_is_beyond_what_it_indexes_and_a_refusal_changes_nothing(tmp_path, algorithm):
    """NumPy reads wherever its generator is said to stand; PyTorch takes moments of any shape, a buffer any position."""
    model = new(algorithm)
    model.learn(100)
    save_checkpoint(tmp_path, model, SETTINGS, PAST)
    arrays, about = unsealed((tmp_path / NAME).read_bytes(), FORMAT)
    other = new(algorithm, seed=1)
    before, text = _told(other), json.dumps(about["content"])

    def loaded(arrays, content):
        (tmp_path / NAME).write_bytes(sealed(arrays, {**about, "content": json.loads(content)}))
        return load_checkpoint(tmp_path, other, SETTINGS)

    wrong = [
        (arrays, re.sub(r'\["pos", \d+\]\]\}\], \["has_gauss"', '["pos", 1000000]]}], ["has_gauss"', text)),
        ({**arrays, "/lanes/returns": np.zeros(3)}, text),
        ({**arrays, "/lanes/returns": np.full(TINY.lanes, np.nan)}, text),
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
        assert _told(other) == before
    assert loaded(arrays, text) == PAST
    assert _told(other)[0] == _told(model)[0]
