"""Sealed files, policies and checkpoints: other arrays or values under a right checksum, other headers, and damage."""

import json
from functools import cache

import gymnasium
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from agents.policy.files import FORMAT, WEIGHTS, read_policy
from agents.policy.sealed import sealed, unsealed
from agents.policy.seeds import policy_folders
from agents.training import checkpoint
from agents.training.configuration import TrainingSettings, algorithm_of
from agents.training.sb3.adapter import SB3VecEnv
from agents.training.sb3.checkpoint import load_checkpoint, save_checkpoint
from agents.training.sb3.model import make_model
from tests.fuzz.strategies import altered, composite, damaged, json_texts, odd_arrays, sampled
from tests.fuzz.watched import cases, watched

SETTINGS, PAST = {"seed": 3, "hidden": [8, 8]}, {"law": {"pooled_mm": 2.5}, "policy": None, "curve": [{"steps": 0, "x": 0.1}]}
TINY = TrainingSettings("BirthSIM/ProbeResidual-v3", steps=64, lanes=2, rollout=16, batch=32, hidden=(8, 8))


@composite
def odd_seals(draw, content, form):
    """Another content of a sealed file."""
    match draw(sampled(("damaged", "header", "arrays", "values", "both"))):
        case "damaged":
            return draw(damaged(content))
        case "header":
            size = int.from_bytes(content[:8], "little")
            header = draw(json_texts(json.loads(content[8 : 8 + size])))
            length = draw(sampled([len(header)]) | sampled((0, 1, 2**63, 2**64 - 1, len(header) + 1)))
            return length.to_bytes(8, "little") + header + content[8 + size :]
        case what:
            arrays, about = unsealed(content, form)
            about = draw(altered(about)) if what != "arrays" else about
            return sealed(draw(odd_arrays(arrays)) if what != "values" else arrays, {**about, "format": form})


@cache
def policy(name):
    """A shipped policy's file; as it is, it is read."""
    (folder, *_) = policy_folders(name)
    read_policy(folder)
    return (folder / WEIGHTS).read_bytes()


@pytest.mark.parametrize("name", ["circle", "circle_honest_student"])
@cases
@given(data=st.data())
def test_a_policy_without_and_with_a_memory(name, data):
    content = data.draw(odd_seals(policy(name), FORMAT))
    with watched("our_policy") as case:
        place = case.folder / "our_policy"
        place.mkdir()
        (place / WEIGHTS).write_bytes(content)
        assert np.isfinite(read_policy(place).network.mean).all()


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A model and its checkpoint's file; as it is, it is read."""
    torch.set_num_threads(1)
    folder = tmp_path_factory.mktemp("checkpoint")
    env = SB3VecEnv(gymnasium.make_vec(TINY.environment, num_envs=2, autoreset_mode="SameStep"))
    env.seed(0)
    env.reset()
    model = make_model(algorithm_of(TINY.algorithm), TINY, env)
    model.learn(64)
    save_checkpoint(folder, model, SETTINGS, PAST)
    load_checkpoint(folder, model, SETTINGS)
    return model, (folder / checkpoint.NAME).read_bytes()


@cases
@given(data=st.data())
def test_a_checkpoint(data, trained):
    model, valid = trained
    content = data.draw(odd_seals(valid, checkpoint.FORMAT))
    with watched(checkpoint.NAME) as case:
        (case.folder / checkpoint.NAME).write_bytes(content)
        assert isinstance(load_checkpoint(case.folder, model, SETTINGS), dict)
