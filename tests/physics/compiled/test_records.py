"""Rows with names: where they stand, what Python and kernels see of them, and what is refused."""

import copy
import pickle

import numpy as np
import pytest

from birthsim_env.loop.loop import Loop
from birthsim_env.loop.rows import ASKED, OPENING, SEEN, WORLD, Seen, Signals, World
from birthsim_env.loop.signals import Motion, Reference, Setpoints
from birthsim_env.loop.stage import Stage, scratch
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows


class Observer(Rows):
    estimate = rows("y1 y2", "m", "positions")
    newest = row("s", "time of the newest sample")


class Memory(Rows):
    bristle = rows("z1 z2", "m", "deflections")
    observer = part(Observer, "observer")
    since = row("s", "since it began")


class History(Rows):
    slot = row("1", "the present")
    past = rows(0, "m", "a ring")


class Gains(Numbers):
    bandwidth = number("1/s", "of the loop")
    corner = rows("x y", "m", "a place")
    observer = part(Observer, "how it begins")


@helper
def summed(memory: Memory, n: int) -> float:
    total = 0.0
    for i in range(n):
        total += memory.observer.estimate[1, i] + 10.0 * memory.since[i]
    return total


@kernel
def named(array):
    return summed(Memory(array), array.shape[1])


@kernel
def of_history(history):
    return history.past.shape[0], history.past[1, 0]


@kernel
def mark(world: World, seen: Seen, memory: Memory, gains: Gains, tables: int, lane: int, n: int) -> int:
    own = Observer(scratch(Observer.size))
    for i in range(n):
        own.newest[i] = gains.bandwidth + gains.corner[1] + gains.observer.newest
        own.estimate[0, i] = gains.corner.shape[0] + gains.rows.shape[0] + memory.bristle.shape[0] + memory.since.shape[0]
        memory.observer.newest[i] += own.newest[i]
        memory.bristle[0, i] = own.estimate[0, i]
        seen.opening[3, i] = world.tick[i] + seen.asked.stiffness_coupling[i]
    return int(summed(memory, n))


def test_rows_stand_where_they_are_written():
    assert (Memory.size, Memory.observer.first, Memory.since.first) == (6, 2, 5)
    assert Memory.bristle.place == slice(0, 2)
    assert History.past.place == slice(1, None)
    assert list(Memory.entries()) == [
        ("z1", "m", "deflections", 1),
        ("z2", "m", "deflections", 1),
        ("observer_y1", "m", "observer: positions", 1),
        ("observer_y2", "m", "observer: positions", 1),
        ("observer_newest", "s", "observer: time of the newest sample", 1),
        ("since", "s", "since it began", 1),
    ]
    assert sum(count for *_, count in World.entries()) == World.size == WORLD
    assert sum(count for *_, count in Seen.entries()) == Seen.size == SEEN
    assert Signals.size == Seen.asked.first == ASKED, "a layout that derives from another one goes on behind it"
    assert (Setpoints.stiffness.first, Reference.stiffness.first) == (0, Motion.size) == (0, 8), "and each has its own places"


def test_views_share_the_array():
    array = np.arange(12.0).reshape(6, 2)
    memory = Memory(array)
    memory.observer.newest[1] = -1.0
    memory.bristle[:] = 7.0
    assert array[4, 1] == -1.0
    assert (array[:2] == 7.0).all()
    assert memory.rows is array
    assert Memory(array[:, 0]).observer.estimate.shape == (2,), "one lane has no axis"
    assert History(array).past.shape == (5, 2)


def test_numbers_are_all_given_and_a_lane_is_zero_where_it_is_not_named():
    assert Gains.numbers(bandwidth=2.0, corner=(3.0, 4.0), observer=5.0).tolist() == [2.0, 3.0, 4.0, 5.0, 5.0, 5.0]
    assert Memory.lane(since=1.0, observer=Observer.lane(newest=3.0)).tolist() == [0.0, 0.0, 0.0, 0.0, 3.0, 1.0]
    for wrong in ({"bandwidth": 1.0}, {"bandwidth": 1.0, "corner": 0.0, "observer": 0.0, "damping": 1.0}):
        with pytest.raises(TypeError, match=r"Gains of bandwidth.*allowed: bandwidth, corner, observer"):
            Gains.numbers(**wrong)
    with pytest.raises(TypeError, match="Memory of damping; allowed: bristle, observer, since"):
        Memory.lane(damping=1.0)
    assert History.lane(slot=1.0, past=[2.0, 3.0]).tolist() == [1.0, 2.0, 3.0]
    assert History.lane().tolist() == [0.0]


def test_kernels_read_what_python_names():
    array = np.random.default_rng(0).normal(size=(6, 5))
    expected = sum(array[3, i] + 10.0 * array[5, i] for i in range(5))
    assert named(array) == summed(Memory(array), 5) == pytest.approx(expected, rel=1e-12)
    assert named(np.asfortranarray(array)) == named(array)
    assert named(array[:, ::2]) == pytest.approx(array[3, ::2].sum() + 10 * array[5, ::2].sum(), rel=1e-12)
    assert named(np.concatenate([array, array])[3:9].copy()) == pytest.approx(array[0].sum() + 10 * array[2].sum(), rel=1e-12)
    assert of_history(History(array)) == (5, array[2, 0])


def test_a_stage_is_handed_what_it_is_annotated_with():
    lanes = 70
    tick, asked, opening = np.arange(1.0 * lanes)[None], np.zeros((Reference.size, lanes)), np.zeros((4, lanes))
    Reference(asked).stiffness_coupling[:] = 0.5
    memory = np.zeros((Memory.size, lanes))
    Memory(memory).since[:] = 1.0
    stage = Stage(mark, Gains.numbers(bandwidth=2.0, corner=(3.0, 4.0), observer=5.0), memory)
    places = [(tick, World.tick.first)], [(asked, Seen.asked.first), (opening, OPENING)]
    assert Loop(lanes, *places, [stage]).run(3) == 3 * 10 * lanes
    assert (Memory(memory).observer.newest == 3 * 11.0).all()
    assert (Memory(memory).bristle[0] == 2 + 6 + 2 + BLOCK).all(), "views have the shape of their group"
    np.testing.assert_array_equal(opening, [np.zeros(lanes)] * 3 + [tick[0] + 0.5])


def test_copies_keep_their_names():
    memory = Memory(np.ones((6, 2)))
    for other in (copy.deepcopy(memory), pickle.loads(pickle.dumps(memory))):
        other.since[:] = 2.0
        assert type(other) is Memory
        assert memory.since[0] == 1.0
