"""What a validation says of errors that are known: settled, lost, beyond the rig's strength."""

from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

from agents.training import validation
from agents.training.validation import VALIDATION_SEED, Score, validate
from tests.training.brief import zero

PROBE = "BirthSIM/ProbeResidual-v3"


class Fake:
    """Three lanes that run for a second; their errors, pushes, openings and demands are known and do not heed the actions."""

    num_envs, steps = 3, 100

    def __init__(self, demands):
        self.seed, self.actions, self.demands = None, [], np.array(demands)
        self.simulation = SimpleNamespace(period=1e-3, periods=10)

    def _info(self, k):
        # Settled are k >= 50. Lane 0: (3, 4) mm, lane 1: 1 mm after 9 mm, lane 2: lost at k = 80.
        error = 1e-3 * np.array([[3, 4], [9 if k < 50 else 1, 0], [2, 0]], float)
        # Lane 0 is pushed along y by 12 N at 2000 N/m: 6 mm are asked for, 4 mm more or less are two thirds. Lane 1 by 4 N.
        force = np.array([[0, -12], [4, 0], [0, 0]], float)
        self.simulation.openings = np.where(np.arange(4)[:, None] == 2, [1.0 if k % 4 == 0 else 0.5, -1.0, 0.3], 0.1)
        return {
            **dict.fromkeys(("position", "velocity", "target"), np.zeros((3, 2))),
            **dict.fromkeys(("pneumatic_stiffness", "pneumatic_stiffness_setpoint"), np.ones((3, 2))),
            **{"tracking_error": error, "user_force": force, "compliant_target": force / 2000},
            **{"stiffness_setpoint": np.full((3, 2), 2000.0), "supply_flow": np.zeros(3), "since_jump": np.full(3, 0.01 * k)},
        }

    def reset(self, seed=None):
        self.seed, self._k = seed, 0
        return np.zeros((3, 3), np.float32), self._info(0)

    def step(self, actions):
        self._k += 1
        self.actions.append(actions)
        terminated = np.array([False, False, self._k == 80])
        return np.full((3, 3), self._k, np.float32), np.zeros(3), terminated, np.zeros(3, bool), self._info(self._k)


@pytest.fixture
def scored(monkeypatch):
    """The score of ``Fake`` with the demands given."""
    monkeypatch.setattr(validation, "required_strength_ratio", lambda env: env.demands)

    def score(*demands):
        env = Fake(demands)
        return env, validate(env, lambda seen: seen[:, :2] * 0.01)

    return score


def test_validation_scores_settled_errors_and_counts_a_lost_lane_as_a_hundred_millimetres(scored):
    env, score = scored(0.4, 0.9, 0.99)
    np.testing.assert_allclose(score.error, [5, 1, 100])
    assert score.lost == 1
    assert score.pooled == pytest.approx(np.sqrt((25 + 1 + 10_000) / 3))
    assert score.tail == pytest.approx(np.quantile([5, 1, 100], 0.95))
    assert env.seed == VALIDATION_SEED
    # The policy was asked with the newest observation every time.
    np.testing.assert_allclose([actions[0, 0] for actions in env.actions], 0.01 * np.arange(100))
    # What the push of 12 N shows of the stiffness; 4 N are too weak to show anything.
    np.testing.assert_allclose(score.stiffness, [100 * 4 / 6, np.nan, np.nan])
    np.testing.assert_allclose(score.saturation[:2], [25, 100])
    figures = score.to_dict()
    assert figures["median_mm"] == pytest.approx(5)
    assert figures["max_mm"] == 100
    assert figures["stiffness_error_percent"] == pytest.approx(100 * 4 / 6)
    assert (figures["infeasible"], figures["lost"]) == (0, 1)
    assert (figures["pooled_mm"], figures["tail_mm"]) == (score.pooled, score.tail)


def test_what_no_controller_can_do_does_not_count(scored):
    _, score = scored(1.0, 0.9, np.inf)
    np.testing.assert_array_equal(score.feasible, [False, True, False])
    assert score.pooled == score.tail == pytest.approx(1)
    figures = score.to_dict()
    assert figures["infeasible"] == 2
    assert figures["max_mm"] == pytest.approx(1)
    assert np.isnan(figures["stiffness_error_percent"])
    assert figures["saturation_percent"] == 100


def test_a_validation_without_any_feasible_world_says_so(scored):
    _, score = scored(1.5, 2.0, np.inf)
    assert score.to_dict()["infeasible"] == 3
    nothing = np.full(2, np.nan)
    assert np.isnan(Score(np.array([3.0, 4.0]), nothing, nothing, nothing, np.zeros(2), 0).to_dict()["hunting_mm"])


def test_validation_does_not_let_a_lost_lane_back_in():
    env = gymnasium.make_vec(PROBE, num_envs=3, authority=500.0, time_constant=0.002, duration=1.5)

    def slam(observations):
        actions = np.zeros((3, 2), np.float32)
        actions[1] = -1.0
        return actions

    score, calm = validate(env, slam, 7), validate(env, zero, 7)
    assert (score.lost, calm.lost) == (1, 0)
    assert score.error[1] == 100
    np.testing.assert_array_equal(score.error[[0, 2]], calm.error[[0, 2]])
