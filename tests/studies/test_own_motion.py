"""``birthsim study own-motion``: a policy and its controller beside the impedance that the controller declares."""

import json
import shutil

import numpy as np
import pytest

from agents.policy.seeds import SHIPPED
from studies.residual import own_motion
from tests.console import call


@pytest.mark.slow
def test_a_policy_stands_beside_its_controller_under_a_moving_hand(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(own_motion, "HANDS", ("noise",))
    shutil.copytree(SHIPPED / "circle_honest_apg" / "seed_1", tmp_path / "own" / "seed_1")
    common = ("--policy", tmp_path / "own", "--episodes", 64, "--seed", 77000000, "--jobs", 1, "--out", tmp_path / "out")
    status, _, complained = call("own-motion", monkeypatch, capsys, *common)
    assert status == 0, complained
    figures = json.loads((tmp_path / "out" / "own-motion.json").read_text())["figures"]
    law, policy = figures["moving"]
    assert law["less"] is None
    less, low, high = policy["less"]
    assert 0.0 < low < less < high < law["error"][0]
    (_, stiffness), (_, other) = figures["static"].items()
    assert np.all(np.diff(stiffness) >= 0)
    assert other[0] < 3.0, "the median"
