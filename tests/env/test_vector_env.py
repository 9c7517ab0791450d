"""The native vector environment: every lane is the single environment of its seed, through all of its episodes."""

from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from birthsim_env.info import FIELDS
from birthsim_env.reward import REWARD_TERMS
from birthsim_env.vector_env import BirthSIMVectorEnv

CIRCLE, PROBE, FORCEPS = "BirthSIM/Circle-v2", "BirthSIM/Probe-v3", "BirthSIM/Forceps-v2"


def make(name=CIRCLE, lanes=3, **arguments):
    env = gymnasium.make_vec(name, num_envs=lanes, **{"autoreset_mode": "SameStep", **arguments})
    assert type(env) is BirthSIMVectorEnv
    return env


def random_actions(steps, lanes, size=4, reach=0.3, seed=0):
    return np.random.default_rng(seed).uniform(-reach, reach, (steps, lanes, size)).astype(np.float32)


def test_a_list_of_seeds_gives_each_lane_its_own_and_none_a_fresh_one():
    env, action = make(lanes=4, randomize=True), np.full((4, 4), 0.1)
    env.reset(seed=[9, 2, 9, None])
    observation = env.step(action)[0]
    np.testing.assert_array_equal(observation[0], observation[2])
    assert not np.array_equal(observation[0], observation[1])
    env.reset(seed=[9, 2, 9, None])
    again = env.step(action)[0]
    np.testing.assert_array_equal(again[:3], observation[:3])
    assert not np.array_equal(again[3], observation[3])


def test_a_reset_without_a_seed_is_the_next_episode_and_never_the_same():
    env = make(lanes=2, randomize=True)
    rows, again = ([env.reset(seed=1)[0], env.reset()[0], env.reset()[0]] for _ in range(2))
    assert len({row.tobytes() for row in rows}) == 3
    np.testing.assert_array_equal(again, rows)
    unseeded = [make(lanes=2, randomize=True).reset()[0] for _ in range(2)]
    assert not np.array_equal(*unseeded)


def test_the_world_of_an_episode_depends_on_seed_and_number_alone():
    arguments = {"randomize": True, "sensors": "lab", "max_episode_steps": 30}
    worlds = []
    for reach in (0.0, 0.6):
        env = make(FORCEPS, 5, **arguments)
        env.reset(seed=3)
        for action in random_actions(75, 5, reach=reach, seed=8):
            infos = env.step(action)[4]
        rows = env.simulation.reference.rows
        force = env.simulation.user_force.force(np.linspace(0, 15, 40)[:, None] * np.ones(5), None, None)
        noise = env.simulation.sensors._keys
        worlds.append([env.simulation.plant.lane_parameters.copy(), rows, force, noise.copy(), infos["position"]])
    calm, wild = worlds
    for part in range(4):
        np.testing.assert_array_equal(calm[part], wild[part])
        assert len(np.unique(calm[part][..., :], axis=-1).T) == 5
    assert np.abs(calm[4] - wild[4]).min() > 0


def test_every_step_returns_arrays_that_later_steps_leave_alone():
    env = make(lanes=3, sensors="lab", max_episode_steps=4)
    observation, infos = env.reset(seed=0)
    kept = [(observation, observation.copy())] + [(value, value.copy()) for value in infos.values()]
    for action in random_actions(9, 3):
        observation, rewards, _, _, infos = env.step(action)
        loop = env.simulation.motion, env.simulation.time, env.simulation.force, env.simulation.reference.rows
        values = (observation, rewards, *(infos[name] for name in (*FIELDS, *REWARD_TERMS)), env.measurement.pressures, *loop)
        kept += [(value, value.copy()) for value in values]
    for value, copy in kept:
        np.testing.assert_array_equal(value, copy)
    assert not any(np.shares_memory(one, other) for (one, _), (other, _) in zip(kept[1:40], kept[60:99], strict=True))


@pytest.mark.parametrize("lanes", [1, 2])
def test_the_callers_action_array_is_neither_kept_nor_written(lanes):
    env, action = make(lanes=lanes, max_episode_steps=2), np.full((lanes, 4), 0.1)
    env.reset(seed=0)
    env.step(action)
    action[:] = -0.1
    # The change of an action counts, though the caller uses one array again and again.
    np.testing.assert_allclose(env.step(action)[4]["reward_action_change"], -0.2 * 0.2 / 8.75)
    np.testing.assert_array_equal(action, -0.1)


@pytest.mark.parametrize(("limit", "steps"), [(7, 7), (10**6, 20), (None, 20), (-1, 20)])
def test_max_episode_steps_shortens_episodes_and_minus_one_does_not(limit, steps):
    env = make(PROBE, 2, max_episode_steps=limit, duration=0.2)
    env.reset(seed=0)
    truncations = [env.step(np.zeros((2, 4)))[3].all() for _ in range(2 * steps)]
    assert truncations == ([False] * (steps - 1) + [True]) * 2


def test_staggered_lanes_end_one_after_the_other_and_live_in_the_same_worlds():
    env, together = (make(lanes=4, duration=0.4, randomize=True) for _ in range(2))
    first, second = env.reset(seed=5, options={"staggered": True})[0], together.reset(seed=5)[0]
    np.testing.assert_array_equal(first, second)
    ends = []
    for step in range(1, 121):
        _, _, terminated, truncated, _ = env.step(np.zeros((4, 4), dtype=np.float32))
        assert not terminated.any()
        ends += [(step, int(lane)) for lane in np.flatnonzero(truncated)]
    assert env.steps == 40
    assert ends == sorted((40 * k - 10 * lane, lane) for lane in range(4) for k in range(1, 5) if 40 * k - 10 * lane <= 120)


ENDING = partial(gymnasium.make_vec, PROBE, num_envs=2, duration=0.4, randomize=True)
SLAM = np.array([[0, 0, 1, -1], [0, 0, 0, 0]], np.float32)


def test_the_next_step_is_gymnasiums_own_default_and_does_what_its_vectorization_does():
    native, generic = ENDING(), ENDING(vectorization_mode="sync")
    assert native.autoreset_mode is native.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    np.testing.assert_array_equal(native.reset(seed=3)[0], generic.reset(seed=3)[0])
    ends = 0
    for _ in range(120):
        (*mine, info), (*its, other) = native.step(SLAM), generic.step(SLAM)
        for one, expected in zip([*mine, info["position"]], [*its, other["position"]], strict=True):
            np.testing.assert_array_equal(one, expected)
        ends += mine[2] + mine[3]
    assert (ends >= 2).all(), "both lanes begin anew, one after it was lost, one at its end"


def test_a_lane_waits_for_its_reset_where_autoreset_is_disabled():
    env = ENDING(autoreset_mode="Disabled")
    env.reset(seed=0)
    while not (terminated := env.step(SLAM)[2]).any():
        pass
    with pytest.raises(ValueError, match=r"lanes \[0\] have ended; allowed: reset\(options=\{'reset_mask': ...\}\)"):
        env.step(SLAM)
    _, info = env.reset(options={"reset_mask": terminated})
    assert info["time"][0] == 0.0 < info["time"][1]
    env.step(SLAM)
