"""The study of memory: trainings differ in what the table says and in nothing else, and a wiped memory is one."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agents.training.differentiated import Differentiated
from baselines.estimation.rig_filter import TOLD
from baselines.network import PolicyNetwork
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from lab.studies import memory
from tests.residual.policies import network


def test_the_file_of_rigs_of_every_size_has_the_ranges_of_the_filter() -> None:
    assert load_parameters("examples/wide_rig.toml").own_ranges == TOLD


@pytest.mark.parametrize("period", memory.STEPS)
def test_trainings_differ_in_what_the_table_says(period: float) -> None:
    (without, below), (with_one, same), (told, _) = (
        memory.settings_of("ideal", *kind, period, 3) for kind in memory.POLICIES.values()
    )
    assert replace(with_one, memory=0, hidden=memory.HIDDEN) == without == replace(told, privileged=False)
    assert (with_one.memory, told.privileged, without.seed) == (32, True, 3)
    assert below == same
    assert (below.policy_period, below.law) == (period, "none")
    assert (without.rollout * period, without.horizon * period) == pytest.approx((0.4, 0.1))


def test_policies_have_about_as_many_weights() -> None:
    """Those of the circle without a controller, which observe 36 numbers."""

    def weights(cells: int) -> int:
        training, _ = memory.settings_of("ideal", cells, False, 0.01, 0)
        made = Differentiated(36, 4, training.hidden, training.memory, squashed=True)
        return sum(one.numel() for one in made.parameters())

    assert weights(32) == pytest.approx(weights(0), rel=0.15)


def test_a_wiped_memory_is_that_of_a_beginning() -> None:
    made: PolicyNetwork = network(cells=6)
    seen = np.random.default_rng(0).normal(size=(7, 5, made.inputs)).astype(np.float32)
    wiped = memory._forgetful(made.acting(), 3)
    found, acts = [wiped(rows) for rows in seen], made.acting()
    for k, rows in enumerate(seen):
        if k % 3 == 0:
            acts = made.acting()
        np.testing.assert_array_equal(found[k], acts(rows))


@pytest.mark.slow
def test_a_piece_has_both_figures_of_a_policy_with_a_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "STEPS", {0.01: 25_600})
    found: dict[str, Any] = memory.learn("ideal", Parameters().to_dict(), 32, False, 0.01, 0, 8, 5000)
    beside = memory.beside("ideal", Parameters().to_dict(), 8, 5000)
    assert 0 < beside["own"]["median"] < found["own"]["median"] < 60.0, "shut valves leave 100 mm"
    assert found["own"]["of"] == found["wiped"]["of"] == beside["own"]["of"]
    assert found["wiped"] != found["own"]
    assert found["seconds"] > 0
