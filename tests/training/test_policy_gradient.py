"""``--algorithm apg``: a policy that learns from scratch in seconds, and a training that goes on with the same bits."""

from dataclasses import replace
from pathlib import Path

import pytest

from agents.policy.files import WEIGHTS, load_policy
from agents.residual.settings import ResidualSettings
from agents.training import policy_gradient
from agents.training.configuration import TrainingSettings
from agents.training.trainer import train

SHORT = TrainingSettings(
    environment="BirthSIM/ProbeResidual-v2", algorithm="apg", steps=20_480, lanes=32, rollout=8, learning_rate=5e-3,
    discount=1.0, hidden=(32, 32), validation_lanes=8, validations=2,
)  # fmt: skip
PURE = ResidualSettings(law="none", policy_period=0.02)
BESIDE = replace(SHORT, target="impedance", beside=("BirthSIM/ProbeResidual-v2 guided",))
INFORMED = replace(PURE, informed=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:  # type: ignore[type-arg]
    folder = tmp_path_factory.mktemp("apg")
    return folder, train(SHORT, PURE, folder)


def test_a_policy_from_scratch_learns_in_80_updates(whole: tuple[Path, dict]) -> None:  # type: ignore[type-arg]
    folder, reached = whole
    # 1.3 to 4.6 mm, by the seed, where shut valves have 21.
    assert reached["policy"]["pooled_mm"] < 0.5 * reached["law"]["pooled_mm"]
    assert reached["policy"]["lost"] == 0
    policy = load_policy(folder)
    assert policy.network.squashed
    assert policy.training["algorithm"] == "apg"


@pytest.mark.slow
@pytest.mark.parametrize(("training", "residual"), [(SHORT, PURE), (BESIDE, INFORMED)])
def test_a_killed_training_ends_with_the_same_policy(
    training: TrainingSettings, residual: ResidualSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reached = train(training, residual, tmp_path / "whole")
    assert reached["policy"]["pooled_mm"] < 0.8 * reached["law"]["pooled_mm"]
    updates, update = [], policy_gradient.PolicyGradient._update

    def killed(self: policy_gradient.PolicyGradient) -> None:
        updates.append(self.steps)
        if len(updates) == 60:
            raise KeyboardInterrupt
        update(self)

    monkeypatch.setattr(policy_gradient.PolicyGradient, "_update", killed)
    with pytest.raises(KeyboardInterrupt):
        train(training, residual, tmp_path / "killed")
    train(training, residual, tmp_path / "killed")
    # It went on from the validation half way.
    assert updates[60] == training.steps // 2
    assert (tmp_path / "killed" / WEIGHTS).read_bytes() == (tmp_path / "whole" / WEIGHTS).read_bytes()
