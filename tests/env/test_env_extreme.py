"""Random policies through the environments at the corners of the documented parameter ranges: a million steps, or 100,000."""

import gymnasium
import numpy as np
import pytest

import birthsim_env
from birthsim_env.parts.drawn.randomization import documented_ranges

CIRCLE, FORCEPS, DYSTOCIA = "BirthSIM/Circle-v1", "BirthSIM/Forceps-v1", "BirthSIM/Dystocia-v1"
SETUPS = [
    *((CIRCLE, "two_valves", "lugre"), (CIRCLE, "one_valve", "coulomb"), (CIRCLE, "two_valves", "coulomb")),
    *((CIRCLE, "one_valve", "lugre"), (FORCEPS, "two_valves", "lugre"), (FORCEPS, "two_valves", "coulomb")),
    *((FORCEPS, "one_valve", "lugre"), (DYSTOCIA, "two_valves", "lugre")),
]


def corner(corner_seed, friction):
    rng = np.random.default_rng(corner_seed)
    changes = {name: float(rng.choice(bounds)) for name, bounds in documented_ranges(birthsim_env.Parameters()).items()}
    return birthsim_env.Parameters().replace({**changes, "friction.law": friction})


def random_actions(rng, steps, lanes, size):
    """Per lane and 0.3 s one of: white noise, held openings, bang-bang noise, full openings held."""
    for step in range(steps):
        if step % 30 == 0:
            held, kind = rng.uniform(-1, 1, (lanes, size)), rng.integers(4, size=(lanes, 1))
        white = rng.uniform(-1, 1, (lanes, size))
        yield np.choose(kind, [white, held, np.sign(white), np.sign(held)])


@pytest.mark.parametrize(("lanes", "steps"), [(64, 200), pytest.param(256, 500, marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", range(len(SETUPS)), ids=["-".join(setup) for setup in SETUPS])
def test_random_policies_leave_only_finite_states(seed, lanes, steps):
    name, valves, friction = SETUPS[seed]
    env = gymnasium.make_vec(
        name, num_envs=lanes, parameters=corner(seed, friction), valves=valves, randomize="scenario", autoreset_mode="SameStep"
    )
    env.reset(seed=seed)
    ended = beyond = 0
    for actions in random_actions(np.random.default_rng(seed), steps, lanes, env.single_action_space.shape[0]):
        observation, rewards, terminated, _, info = env.step(actions)
        assert np.isfinite(observation).all()
        assert np.isfinite(rewards).all()
        assert all(np.isfinite(info[field]).all() for field in ("position", "pressure", "temperature", "piston_velocity"))
        assert np.all((info["pressure"] > 0.2e5) & (info["pressure"] < 20e5))
        if terminated.any():
            last = info["final_info"]["pressure"][terminated]
            ended += len(last)
            beyond += int(np.any((last < 0.2e5) | (last > 20e5), axis=1).sum())
            # A chamber that a flung mass squeezes in its last 10 ms may pass 20 bar; the episode ends there.
            assert last.min() > 0.1e5
            assert last.max() < 60e5
    assert ended > lanes / 2, "random openings must drive pistons into the end stops"
    assert beyond <= 1e-3 * lanes * steps
