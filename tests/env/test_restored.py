"""``set_state`` with whatever a damaged or foreign file may hold: refused before anything changes, or the next step works.

What it restores is handed to compiled code, which looks at no index: a wrong one ends the process, and this test with it.
"""

import json
from contextlib import nullcontext, suppress
from itertools import groupby
from operator import itemgetter

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import birthsim_env
from baselines.driving import driving
from baselines.named import make_controller
from birthsim_env.restored import generator_complaint
from birthsim_env.state import give_state, take_state
from tests.contracts.test_environments import WORLDS, made

RIG = birthsim_env.Parameters()
CASES = ("circle honest", "hand guided", "impedance variable", "limited:admittance")
NUMBERS = (1e9, -1, np.nan, np.inf)
PLAIN = (10**9, -1, float("nan"), "x", None, {"tuple": [1]})
NAMES = ("step", "__class__", "extra")


def _env(case):
    if case in WORLDS:
        return made(case, 2)
    law = driving(make_controller(case, RIG), case)
    return gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2, policy_period=1e-3, sensors="honest", actuation=law)


def _words(plain):
    return np.frombuffer(json.dumps(plain).encode(), dtype=np.uint8)


def _said(state):
    plain = json.loads(state["plain"].tobytes())
    return {
        **{name: value.tobytes() for name, value in state.items()},
        "plain": {k: v for k, v in plain.items() if v is not None},
    }


def _odd(array):
    """Arrays that may not, or should not, stand where ``array`` stood."""
    for number in NUMBERS:
        if array.dtype == np.float64 or (array.dtype.kind == "i" and abs(number) < 2**63):
            yield np.full_like(array, number)
    yield from (np.zeros(array.shape, kind) for kind in ("f2", "c16", "i8" if array.dtype.kind == "f" else "f8", object))
    yield from (np.stack([array, array]), np.array(0.0), None, "text", array[:0] if array.ndim else array[None])
    if array.ndim:
        yield from (np.concatenate([array, array]), array[:-1], array.T)


def _variants(good):
    """(what was changed, another state) of every entry."""
    plain = json.loads(good["plain"].tobytes())
    for name, array in good.items():
        yield name, {key: value for key, value in good.items() if key != name}
        if name != "plain":
            yield from ((name, {**good, name: odd}) for odd in _odd(array))
            yield name, {**good, "plain": _words({**plain, name: 3})}
    for name in plain:
        yield name, {**good, "plain": _words({key: value for key, value in plain.items() if key != name})}
        yield from ((name, {**good, "plain": _words({**plain, name: odd})}) for odd in PLAIN)
        yield name, {**good, name: np.zeros(3)}
    for owner in sorted({name.rpartition(".")[0] for name in (*good, *plain)}):
        new = (f"{owner}.{name}".lstrip(".") for name in NAMES)
        yield from ((name, {**good, name: np.zeros(3)}) for name in new if name not in good and name not in plain)


def _refusal(env, state):
    """What ``set_state`` says, or nothing where it takes the state."""
    try:
        env.set_state(state)
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("case", CASES)
def test_every_entry_is_checked_before_anything_changes(case):
    env = _env(case)
    env.reset(seed=0)
    zero = np.zeros(env.action_space.shape)
    for _ in range(3):
        env.step(zero)
    good, refused = env.get_state(), 0
    env.set_state(good)
    before = _said(env.get_state())
    for name, variants in groupby(_variants(good), key=itemgetter(0)):
        taken = []
        for _, state in variants:
            said = _refusal(env, state)
            assert not said or "allowed: " in said, name
            taken += [] if said else [state]
            if not said:
                env.set_state(good)
            refused += bool(said)
        assert _said(env.get_state()) == before, name
        for state in taken:
            env.set_state(state)
            # A setpoint that is possible by itself may be one that the law inside cannot render.
            with suppress(ValueError) if "stiffness" in name else nullcontext():
                env.step(zero)
        env.set_state(good)
    assert refused > 300


@pytest.fixture(scope="module")
def honest():
    env = made("circle honest", 2)
    env.reset(seed=0)
    return env, env.get_state()


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_any_numbers_in_some_entries_are_refused_or_work(honest, data):
    env, good = honest
    names = data.draw(st.lists(st.sampled_from([name for name in good if name != "plain"]), min_size=1, max_size=3))
    state = dict(good)
    for name in names:
        array = good[name].copy()
        if array.size:
            number = data.draw(
                st.floats(width=32) if array.dtype.kind == "f" else st.integers(0, 1 if array.dtype.kind == "b" else 2**62)
            )
            array.flat[data.draw(st.integers(0, array.size - 1))] = number
        state[name] = array
    said = _refusal(env, state)
    assert not said or "allowed: " in said
    if not said:
        env.step(np.zeros((2, 4)))


def test_more_knots_than_there_are_and_none_are_refused_by_name():
    env = made("circle honest", 2)
    env.reset(seed=0)
    good = env.get_state()
    name = next(one for one in good if one.endswith("._counts"))
    for count in (0.0, 1e9, np.nan, 1.5):
        with pytest.raises(ValueError, match=r"_counts' .*; allowed: (whole numbers from 1 to 33|finite numbers)"):
            env.set_state({**good, name: np.full(2, count)})


def test_a_refused_state_does_not_begin_an_environment():
    env, other = (gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2) for _ in range(2))
    other.reset(seed=5)
    with pytest.raises(ValueError, match="is missing"):
        env.set_state({name: value for name, value in other.get_state().items() if name != "ended"})
    with pytest.raises(RuntimeError, match=r"get_state\(\) before reset"):
        env.get_state()
    env.set_state(other.get_state())


class Hand(birthsim_env.UserForce):
    """A user's own, which makes an attribute in its first period."""

    def __init__(self, kind):
        self.rng, self.calls = np.random.Generator(kind(0)), 0

    def force(self, time, position, velocity):
        self.calls += 1
        self.last = self.rng.normal(size=2)
        return np.broadcast_to(self.last[:, None], (len(time), 2, time.shape[1]))

    def lean(self):
        return 0.0


@pytest.mark.parametrize("kind", [np.random.PCG64, np.random.MT19937, np.random.Philox, np.random.SFC64])
def test_any_generator_of_numpy_goes_on(kind):
    one, other = (gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2, user_force=Hand(kind)) for _ in range(2))
    one.reset(seed=0), one.step(np.zeros((2, 4)))
    other.set_state(one.get_state())
    np.testing.assert_array_equal(one.step(np.zeros((2, 4)))[0], other.step(np.zeros((2, 4)))[0])
    for new in ("lean", "__class__", "a b"):
        with pytest.raises(ValueError, match=f"user_force.{new}' is unknown"):
            other.set_state({**one.get_state(), f"episodes.simulation.user_force.{new}": np.zeros(3)})


@pytest.mark.parametrize("kind", [np.random.MT19937, np.random.Philox])
def test_a_generator_that_would_read_beyond_its_table_is_refused(kind):
    """NumPy takes such a position, and reads there."""
    rng = np.random.Generator(kind(0))
    state = rng.bit_generator.state
    table = state if "buffer_pos" in state else state["state"]
    table["buffer_pos" if "buffer_pos" in state else "pos"] = 10**6
    assert "stands beyond its table" in generator_complaint(rng, state)


def test_tables_of_a_part_that_is_compiled_keep_their_length():
    """A schedule of a user's own runs the package's code: it looks up as many starts as there are setpoints."""

    class Own(birthsim_env.StiffnessSchedule):
        pass

    part = Own()
    part.prepare(2)
    good = take_state({"part": part})
    with pytest.raises(ValueError, match=r"_values' has shape \(2, 5, 2\); allowed: \(1, 5, 2\)"):
        give_state({"part": part}, {**good, "part._values": np.full((2, 5, 2), 2000.0)})
