"""What can be drawn is reachable, or refused where the environment is made: no later reset meets a scenario that is not."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from birthsim_env import Circle, Hold, Parameters, Path
from birthsim_env.parts.courses import check_drawn
from birthsim_env.parts.scenarios import SCENARIOS, environment_id
from studies.fuzz.odd_rigs import odd_rig

LATE = (116, 243)
"""Seeds of odd rigs whose first episodes were reachable, and later ones not."""


def made(name, seed):
    """An environment of an odd rig that has begun, or in words why there is none."""
    rig = Parameters.from_dict(odd_rig(seed))
    try:
        env = gymnasium.make_vec(name, num_envs=64, parameters=rig, randomize="scenario", autoreset_mode="SameStep")
        env.reset(seed=0)
    except ValueError as error:
        return str(error)
    return env


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_an_odd_rig_that_is_taken_reaches_every_later_episode(scenario):
    found = [made(environment_id(scenario), seed) for seed in (*LATE, *range(24))]
    words = [one for one in found if isinstance(one, str)]
    assert all("of one that can be drawn: position" in one or "can carry" in one for one in words)
    taken = [one for one in found if not isinstance(one, str)]
    assert taken
    for env in taken:
        for _ in range(8):
            env.reset()


@pytest.mark.parametrize(
    "trajectory",
    [
        Circle(radius=(0.05, 0.21)), Hold(((0.45, 0.71), 0.0)), Hold((0.5, (-0.5, 0.0))), Hold(((0.295, 0.4), (-0.1, 0.2))),
        Path((0.5, 0.0), 0.0, (0.05, 0.25)), Path((0.5, 0.0), (-3.0, 3.0), 0.21, ends=2.0),
    ],
)  # fmt: skip
def test_ranges_that_leave_the_workspace_are_refused_before_any_episode(trajectory):
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(
            ValueError, match=r"reference at .* s, of one that can be drawn: .* is unreachable; allowed: distance"
        ):
            make("BirthSIM/Circle-v1", reference=trajectory)


def test_the_scenarios_themselves_are_reachable_by_the_default_rig():
    for scenario in SCENARIOS.values():
        check_drawn(scenario.varied()[0], scenario.duration, Parameters())


def test_a_trajectory_that_is_checked_stays_as_it_was():
    trajectory = Hold(((0.4, 0.6), (-0.1, 0.06)))
    trajectory.prepare(3)
    trajectory.begin(1, np.random.default_rng(0))
    before = trajectory.sample(np.zeros(3))
    check_drawn(trajectory, 5.0, Parameters())
    np.testing.assert_array_equal(trajectory.sample(np.zeros(3)), before)
