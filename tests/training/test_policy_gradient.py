"""``--algorithm apg``: a policy that learns from scratch in seconds. That a killed training goes on: ``test_kills``."""

from dataclasses import replace

import pytest

from agents.policy.files import read_policy
from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings
from agents.training.trainer import train

SHORT = TrainingSettings(
    environment="BirthSIM/ProbeResidual-v3",
    algorithm="apg",
    steps=20_480,
    lanes=32,
    rollout=8,
    learning_rate=5e-3,
    discount=1.0,
    hidden=(32, 32),
    validation_lanes=8,
    validations=2,
    noise=0.08,
)
PURE = ResidualSettings(law="none", policy_period=0.02)
BESIDE = replace(SHORT, target="impedance", beside=("BirthSIM/ProbeResidual-v3 guided",))
ON_A_RAIL = replace(SHORT, environment="BirthSIM/RailResidual-v0", learning_rate=2e-2)
INFORMED = replace(PURE, informed=True)


@pytest.mark.parametrize(
    ("settings", "residual", "most"),
    [(SHORT, PURE, 0.5), (ON_A_RAIL, PURE, 0.5), pytest.param(BESIDE, INFORMED, 0.8, marks=pytest.mark.slow)],
)
def test_a_policy_from_scratch_learns_in_80_updates(settings, residual, most, tmp_path):
    reached = train(settings, residual, tmp_path)
    # Shut valves leave 17 mm, 54 mm on a rail, and 8 mm of what the last one is for.
    assert reached["policy"]["pooled_mm"] < most * reached["law"]["pooled_mm"]
    assert reached["policy"]["lost"] == 0
    policy = read_policy(tmp_path)
    assert policy.network.squashed
    assert policy.training["algorithm"] == "apg"
