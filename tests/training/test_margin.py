"""Rigs of training reach beyond those of validation, on the side where rigs oscillate."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.residual.settings import ResidualSettings
from agents.training import trainer
from agents.training.configuration import TrainingSettings
from agents.training.margin import widened
from agents.training.reached import Reached
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.rig.parameters import Parameters

MASSES, SLOWEST = (2.0, 5.0), 0.008
"""kg; s: what ``Mechanics.mass`` and ``Valves.time_constant`` document."""


def test_ranges_reach_further_on_one_side() -> None:
    known, wide = documented_ranges(Parameters()), documented_ranges(widened(Parameters(), 0.5))
    assert wide["mechanics.mass"] == pytest.approx((MASSES[0] / 1.5, MASSES[1]))
    assert wide["valves.time_constant"] == pytest.approx((0.0015, 1.5 * SLOWEST))
    assert {name for name in known if wide[name] == known[name]} == {"chambers.dead_volume", "chambers.wall_heat_transfer"}


def test_an_owners_own_ranges_count() -> None:
    rig = Parameters.from_dict({"randomize": {"mechanics.mass": [7.0, 10.0], "air.supply_pressure": [6e5, 7e5]}})
    ranges = documented_ranges(widened(rig, 0.25))
    assert ranges["mechanics.mass"] == (7.0 / 1.25, 10.0)
    assert ranges["air.supply_pressure"] == (6e5, 7e5)


class Looks:
    """Learns nothing, and sees what rigs there are."""

    found: dict[str, tuple[float, float]]
    steps = 0

    def __init__(self, settings: TrainingSettings, envs: Sequence[Any], folder: Path) -> None:
        for env in envs:
            env.reset(seed=0)
        Looks.found = {"training": self._drawn(envs)}

    def load(self, settings: dict[str, Any]) -> None: ...

    def learn(self, reached: Reached, *_: Any) -> None:
        Looks.found["validation"] = self._drawn(reached.envs)

    @staticmethod
    def _drawn(envs: Sequence[Any]) -> tuple[float, float]:
        rigs = np.concatenate([env.unwrapped.simulation.plant.lane_parameters for env in envs], axis=1)
        return rigs[at.MASS].min(), rigs[at.TAU].max()


def test_only_training_meets_the_margin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trainer, "PolicyGradient", Looks)
    training = TrainingSettings("BirthSIM/ProbeResidual-v2", "apg", lanes=128, validation_lanes=128, margin=0.25)
    trainer.train(training, ResidualSettings(law="none", policy_period=0.1), tmp_path)
    lightest, slowest = Looks.found["validation"]
    assert lightest >= MASSES[0]
    assert slowest <= SLOWEST
    # Of the masses and time constants in training 12 and 24 % are beyond that.
    lightest, slowest = Looks.found["training"]
    assert lightest < MASSES[0]
    assert slowest > SLOWEST
