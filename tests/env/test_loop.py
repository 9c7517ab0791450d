"""The closed loop: compiled stages, stops for a user's Python, lanes, threads, processes and copies, all to the last bit."""

import copy
import multiprocessing
import pickle

import gymnasium
import numpy as np
import pytest

import agents  # noqa: F401  registers the residual environments
from birthsim_env import Circle, StiffnessSchedule
from birthsim_env.loop.loop import available_threads
from birthsim_env.parts.actuation import ValveActuation
from birthsim_env.parts.hands.steps import AlternatingSteps
from birthsim_env.parts.hands.user_forces import ForceProfile
from birthsim_env.parts.sensors.ideal import IdealSensors
from birthsim_env.registry import names
from tests.registered import registered

CIRCLE, RESIDUAL = "BirthSIM/Circle-v2", "BirthSIM/CircleResidual-v2"


def course(env, steps=25, seed=3):
    """States, openings, observations, measurements, rewards and info of a run under random actions."""
    rng, (first, info) = np.random.default_rng(0), env.reset(seed=seed)
    found = [first, *info.values()]
    for _ in range(steps):
        actions = rng.uniform(-0.2, 0.2, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(actions)
        simulation = env.unwrapped.simulation
        seen = [value for value in vars(simulation.measurement).values() if isinstance(value, np.ndarray)]
        found += [observation, reward, terminated, truncated, *seen, simulation.openings, simulation.plant.state.copy()]
        found += [np.asarray(value) for name, value in info.items() if "final" not in name]
    return found


def assert_same(one, other):
    assert len(one) == len(other)
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


class OwnValves(ValveActuation):
    """Without stages the loop stops for it."""

    def stages(self, lanes, sampled, foreign):
        return None


def own(part, method):
    """A class that does what ``part`` does, asked in Python since its ``method`` is another."""
    return type(f"Own{part.__name__}", (part,), {method: lambda self, *asked: getattr(part, method)(self, *asked)})


OwnCircle, OwnSchedule = own(Circle, "sample"), own(StiffnessSchedule, "sample")


def schedule(kind=StiffnessSchedule):
    return kind((0.0, 0.1), (2000.0, 4000.0), (4600.0, 3600.0), (2300.0, 1800.0))


@pytest.mark.parametrize(
    "changed",
    [
        {"reference": OwnCircle()},
        {"user_force": own(AlternatingSteps, "force")(repeats=1)},
        {"stiffness": schedule(OwnSchedule)},
        {"actuation": OwnValves("two_valves")},
        {"sensors": "own"},
        {"reference": OwnCircle(), "stiffness": schedule(OwnSchedule), "actuation": OwnValves("two_valves")},
    ],
    ids="+".join,
)
def test_a_stop_for_a_users_python_changes_no_bit(changed, monkeypatch):
    registered(monkeypatch, own(IdealSensors, "measure"), sensors="own")
    compiled = {"reference": Circle(), "user_force": AlternatingSteps(repeats=1), "stiffness": schedule()}
    one, other = (gymnasium.make_vec(CIRCLE, num_envs=3, **arguments) for arguments in (compiled, {**compiled, **changed}))
    assert_same(course(one), course(other))
    pieces = [len(env.unwrapped.simulation._loop._pieces) for env in (one, other)]
    assert pieces[0] == 1 < pieces[1], "what is compiled is one piece; a user's part stands between others"


@pytest.mark.parametrize("sensors", names("sensors"))
@pytest.mark.parametrize("name", [CIRCLE, RESIDUAL])
def test_threads_change_no_bit(name, sensors):
    runs = [
        course(gymnasium.make_vec(name, num_envs=130, num_threads=threads, sensors=sensors, randomize=True), 12)
        for threads in (1, 2, 3, 50)
    ]
    for other in runs[1:]:
        assert_same(runs[0], other)


def test_threads_are_all_that_there_are_unless_one_says_so(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    usable = available_threads()
    assert gymnasium.make_vec(CIRCLE, num_envs=2).unwrapped.simulation.threads == usable >= 1
    assert gymnasium.make(CIRCLE).unwrapped.simulation.threads == 1
    assert gymnasium.make_vec(CIRCLE, num_envs=2, num_threads=7).unwrapped.simulation.threads == 7
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert gymnasium.make_vec(CIRCLE, num_envs=2).unwrapped.simulation.threads == 1


def _child(connection, env):
    connection.send(course(env, 5))
    connection.close()


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork")
def test_a_fork_has_threads_of_its_own():
    env = gymnasium.make_vec(CIRCLE, num_envs=90, num_threads=3)
    expected = course(env, 5)
    here, there = multiprocessing.get_context("fork").Pipe()
    process = multiprocessing.get_context("fork").Process(target=_child, args=(there, env))
    process.start()
    assert here.poll(120), "the child hangs"
    assert_same(here.recv(), expected)
    process.join()
    assert process.exitcode == 0


@pytest.mark.parametrize("name", [CIRCLE, RESIDUAL])
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["deepcopy", "pickle"])
def test_a_copy_in_the_middle_of_an_episode_goes_on_alone(name, copied):
    env = gymnasium.make(name, sensors="lab", randomize=True, render_mode="rgb_array").unwrapped
    env.reset(seed=1)
    env.render()
    size = env.action_space.shape
    for k in range(10):
        env.step(np.full(size, 0.1 * (-1) ** k, np.float32))
    other = copied(env)
    before = env.simulation.plant.state.copy()
    ahead = [other.step(np.full(size, 0.1, np.float32))[0] for _ in range(10)]
    np.testing.assert_array_equal(env.simulation.plant.state, before)
    np.testing.assert_array_equal([env.step(np.full(size, 0.1, np.float32))[0] for _ in range(10)], ahead)
    np.testing.assert_array_equal(env.render(), other.render())


def test_a_loop_is_built_anew_only_where_a_part_has_other_arrays():
    env = gymnasium.make_vec(CIRCLE, num_envs=2, user_force=ForceProfile([(0.0, 1.0, 0.0)])).unwrapped
    env.reset(seed=0)
    before = env.simulation._loop
    env.reset(seed=1)
    assert env.simulation._loop is before
    # More knots need more room, and what reads them must find it.
    env.simulation.user_force._fixed = [(0.1 * k, 2.0, 0.0) for k in range(9)]
    env.reset(seed=1)
    assert env.simulation._loop is not before
    np.testing.assert_array_equal(env.simulation.force[0], 2.0)


def test_little_work_is_not_shared_out(monkeypatch):
    used = []
    monkeypatch.setattr("birthsim_env.loop.loop._pool", lambda process, threads: used.append(threads))
    env = gymnasium.make_vec(CIRCLE, num_envs=100, num_threads=4, policy_period=0.001)
    env.reset(seed=0)
    env.step(np.zeros((100, 4), np.float32))
    assert used == [], "100 lanes times one period are done sooner than a thread is set to work"
