"""A closed loop differentiated: bits of the forward loop, gradients of what is paid against differences, refusals."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

import agents  # noqa: F401  registers the residual environments
from birthsim_env.gradients import Recorder
from birthsim_env.parts.hands.moving_hands import Guided
from birthsim_env.parts.hands.user_forces import UserForce

STEPS, LANES = 4, 40

LOOPS: dict[str, tuple[str, dict[str, Any]]] = {
    "valves": ("BirthSIM/Circle-v1", {}),
    "one valve, flows": ("BirthSIM/Forceps-v1", {"action_mode": "flow", "valves": "one_valve"}),
    "no law": ("BirthSIM/VacuumResidual-v0", {"law": "none"}),
    "paper's law": ("BirthSIM/ProbeResidual-v2", {"law": "backstepping"}),
    "residual of 5": ("BirthSIM/DystociaResidual-v1", {"law": "backstepping-force-first", "impedance": "variable"}),
    "admittance": ("BirthSIM/DescentResidual-v1", {"law": "admittance-backstepping"}),
}


def lanes_of(name: str, state: Any = None) -> Any:
    world, arguments = LOOPS[name]
    env: Any = gymnasium.make_vec(world, num_envs=LANES, randomize=True, **arguments).unwrapped
    env.reset(seed=5)
    if state is not None:
        env.set_state(state)
    return env


def size_of(env: Any) -> int:
    return int(env.single_action_space.shape[0])


FAST = ("valves",)


@pytest.mark.parametrize("name", [name if name in FAST else pytest.param(name, marks=pytest.mark.slow) for name in LOOPS])
def test_gradients_of_what_is_paid_are_differences(name: str) -> None:
    """Of rewards over four policy steps to their actions, drawn rigs: median 1e-7, nine in ten 1e-6, whatever the law; the rest
    stands on kinks, of rewards |e| and |change of action|, and of friction."""
    rng, plain = np.random.default_rng(0), lanes_of(name)
    for _ in range(20):
        plain.step(0.1 * rng.standard_normal((LANES, size_of(plain))))
    start = plain.get_state()
    taped = lanes_of(name, start)
    recorder = Recorder(taped.simulation)
    actions = 0.1 * rng.standard_normal((STEPS, LANES, size_of(plain)))
    way, weights = rng.standard_normal(actions.shape), rng.standard_normal((STEPS, LANES))
    backs = []
    for action in actions:
        (seen, paid, *_), (its, its_pay, *_) = plain.step(action), taped.step(action)
        assert np.array_equal(seen, its)
        assert np.array_equal(paid, its_pay)
        backs.append(recorder.taken())
    assert np.array_equal(plain.simulation.plant.state, taped.simulation.plant.state)
    carried, parts = None, np.zeros((STEPS, LANES))
    for k in reversed(range(STEPS)):
        carried, by_action = backs[k](carried=carried, reward=weights[k])
        parts[k] = (by_action.T * way[k]).sum(axis=1)

    def earned(size: float) -> Any:
        plain.set_state(start)
        return sum(weights[k] * plain.step(actions[k] + size * way[k])[1] for k in range(STEPS))

    difference = (earned(1e-6) - earned(-1e-6)) / 2e-6
    off = np.abs(difference - parts.sum(axis=0)) / np.abs(parts).sum(axis=0)
    assert np.quantile(off, 0.5) < 1e-7
    assert np.quantile(off, 0.9) < 1e-6


def test_observations_state_and_motion_have_gradients() -> None:
    """Openings drive pistons: what an observed error, the true place and a piston say of it is the same."""
    env = lanes_of("valves")
    recorder = Recorder(env.simulation)
    env.step(np.zeros((LANES, 4)))
    back = recorder.taken()
    seen, motion = np.zeros(env.observation_space.shape), np.zeros((4, LANES))
    seen[:, 0], motion[0] = 0.01, 1.0
    _, by_observed = back(observation=seen)
    _, by_motion = back(motion=motion)
    assert np.abs(by_motion).max() > 0
    np.testing.assert_allclose(by_observed, by_motion, rtol=1e-9, atol=1e-12 * np.abs(by_motion).max())
    state = np.zeros((18, LANES))
    state[2] = 1.0
    _, by_piston = back(state=state)
    assert np.abs(by_piston).max() > 0


def test_threads_change_no_bit() -> None:
    found = []
    for threads in (1, 2):
        env: Any = gymnasium.make_vec("BirthSIM/Circle-v1", num_envs=100, randomize=True, num_threads=threads).unwrapped
        env.reset(seed=1)
        recorder = Recorder(env.simulation)
        env.step(np.full((100, 4), 0.03))
        found.append(recorder.taken()(reward=np.ones(100)))
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)
        assert np.abs(one).max() > 0


def test_what_has_no_gradients_is_refused_by_name() -> None:
    class Own(UserForce):
        def force(self, time: Any, position: Any, velocity: Any) -> Any:
            return np.zeros((*time.shape[:1], 2, time.shape[1]))

    for arguments, words in (
        ({"sensors": "lab"}, "_lab_stage.*allowed"),
        ({"user_force": Guided()}, "Guided.*allowed"),
        ({"user_force": Own()}, "user's own part.*allowed"),
        ({"parameters": None, "randomize": {"valves.deadband": (0.01, 0.02)}}, r"valves\.deadband.*allowed"),
    ):
        env: Any = gymnasium.make_vec("BirthSIM/Probe-v2", num_envs=2, **arguments).unwrapped
        env.reset(seed=0)
        with pytest.raises(ValueError, match=words):
            Recorder(env.simulation).prepare()
