"""What acts on a built loop from outside does what the same does in Python: a person's hand, setpoints, another law."""

import math

import numpy as np
import pytest

from birthsim_build.image import HEAD, LEFT_OUT
from birthsim_build.layout import ROWS
from birthsim_build.stages import FORCE_TIME, SETPOINTS_TIME
from birthsim_env import StiffnessSchedule, UserForce
from birthsim_env.parts.scenarios import SCENARIOS
from studies.targets.reference import PERIODS, SHARED, loop_rows
from studies.targets.running import ROW, library_loop, node_rows
from tests.build.targets import assert_same_bits, need_program

LOOP = {"scenario": "circle", "sensors": "ideal", "controller": "admittance-backstepping"}
STIFFNESS, DAMPING, LIMIT = 800.0, 20.0, 25.0
HELD = np.where((np.arange(PERIODS) // 300) % 2, 1.0, 0.0)
POINTER = np.array([0.5 + 0.02 * np.sin(0.01 * np.arange(PERIODS)), 0.03 * np.cos(0.013 * np.arange(PERIODS))])
PUSH = np.where(np.arange(PERIODS) > 900, 7.0, 0.0)


@pytest.fixture
def in_node(wasm, tmp_path):
    need_program("node", "nodejs")
    return lambda choice=LOOP, **options: node_rows(wasm, ["loop", choice], tmp_path, PERIODS, **options)[0]


class Held(UserForce):
    """The scenario's hand, another push along y, and a spring to the pointer that pulls no harder than its limit."""

    closed_loop = True

    def __init__(self):
        self.own = SCENARIOS["circle"].nominal()[1]
        self.jump_rate = self.own.jump_rate

    def prepare(self, num_envs):
        self.own.prepare(num_envs)

    def begin(self, lane, rng):
        self.own.begin(lane, rng)

    def force(self, time, position, velocity):
        forces, now = self.own.force(time, position, velocity), round(float(time[0, 0]) * 1000) - 1
        if now >= 0:
            forces[0, 1, 0] += PUSH[now]
            if HELD[now]:
                pull = STIFFNESS * (POINTER[:, now] - position[:, 0]) - DAMPING * velocity[:, 0]
                size = math.sqrt(pull[0] * pull[0] + pull[1] * pull[1])
                forces[0, :, 0] += pull * (LIMIT / size) if size > LIMIT else pull
        return forces


def test_a_person_s_hand(in_node):
    constants = {"pointer_stiffness": STIFFNESS, "pointer_damping": DAMPING, "pointer_limit": LIMIT}
    inputs = {name: np.full(PERIODS, value) for name, value in constants.items()}
    inputs |= {"pointer_held": HELD, "pointer_x": POINTER[0], "pointer_y": POINTER[1], "add_force_y": PUSH}
    rows = in_node(inputs=inputs)
    expected = loop_rows("circle", "ideal", LOOP["controller"], user_force=Held())
    assert_same_bits(rows[:, SHARED], expected[:, SHARED])


ASKED = np.where(np.arange(PERIODS) >= 700, 3100.0, 2000.0)


class Chosen(StiffnessSchedule):
    """A person's Kclx from the first period on, and 150 N/m more than the scenario asks for along y."""

    def __init__(self):
        self.own = SCENARIOS["circle"].nominal()[2]

    def prepare(self, num_envs):
        self.own.prepare(num_envs)

    def begin(self, lane, rng):
        self.own.begin(lane, rng)

    def sample(self, time):
        rows, now = np.array(self.own.sample(time)), round(float(time[0]) * 1000) - 1
        if 0 <= now < PERIODS:
            rows[0], rows[1] = ASKED[now], rows[1] + 150.0
        return rows


def test_setpoints_of_a_person(in_node):
    inputs = {"keep_Kclx": np.zeros(PERIODS), "add_Kclx": ASKED, "add_Kcly": np.full(PERIODS, 150.0)}
    rows = in_node(inputs=inputs)
    expected = loop_rows("circle", "ideal", LOOP["controller"], stiffness=Chosen())
    assert_same_bits(rows[:, SHARED], expected[:, SHARED])


def test_setpoints_and_a_hand_s_force_pass_over(in_node):
    at, since = 1300, (np.arange(PERIODS) - 1300) * 1e-3  # a push of the scenario is on
    later, once = np.where(since >= 0, 0.0, 1.0), np.where(since == 0, 1.0, 0.0)
    inputs = {"keep_Kclx": later, "keep_force": later, "pass_setpoints": once, "pass_force": once}
    rows = in_node(inputs={**inputs, "add_Kclx": np.where(since >= 0, 3000.0, 0.0)})
    stiffness, force = rows[:, ROW["reference_Kclx"]], rows[:, ROW["force_x"]]
    assert force[at - 1] > 1
    assert (stiffness[at], force[at]) == (stiffness[at - 1], force[at - 1])
    for found, start, end, lasts in ((stiffness, 2000.0, 3000.0, SETPOINTS_TIME), (force, force[at - 1], 0.0, FORCE_TIME)):
        u = np.clip(since / lasts, 0.0, 1.0)[at:]
        passed = u**3 * (10 - 15 * u + 6 * u * u)
        assert found[at:] == pytest.approx(start + passed * (end - start), rel=1e-9, abs=1e-9)
        assert found[-1] == end


def test_one_valve_per_cylinder(in_node):
    rows = in_node({**LOOP, "valves": "one_valve"})
    assert_same_bits(rows[:, SHARED], loop_rows("circle", "ideal", LOOP["controller"], valves="one_valve")[:, SHARED])


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_another_law_takes_over(in_node, sensors):
    exchange = {"at": 777, "controller": "residual:circle", "sensors": sensors}
    rows = in_node({**LOOP, "sensors": sensors}, exchange=exchange)
    assert_same_bits(rows[:, SHARED], loop_rows("circle", sensors, LOOP["controller"], exchange=exchange)[:, SHARED])


@pytest.fixture
def loop(library):
    """``advance`` of the library, and a loop of its as words."""
    advance, first = library_loop(library, "circle_lab_admittance_backstepping")
    return lambda words, periods: advance(words.ctypes.data, periods), first


def test_a_copy_goes_on_by_itself(loop):
    advance, one = loop
    advance(one, 500)
    other = one.copy()
    advance(one, 500)
    one_rows = one[HEAD : HEAD + ROWS].copy()
    one[:] = 0
    advance(other, 500)
    assert (other[HEAD : HEAD + ROWS] == one_rows).all()


def test_parts_are_left_out(loop):
    advance, words = loop
    rows = words[HEAD : HEAD + ROWS].view(np.float64)
    advance(words, 50)
    words[LEFT_OUT], before = ~1, rows.copy()  # all but the first, which is the law
    assert advance(words, 1) == 0
    changed = {name for name, number in ROW.items() if rows[number] != before[number]}
    assert "opening_P1" in changed
    assert not changed & {"time", "tick", "x", "Pp1", "measured_x", "reference_x"}
    words[LEFT_OUT] = 0
    advance(words, 1)
    assert rows[ROW["time"]] == pytest.approx(0.051)


def test_a_setpoint_that_cannot_be_served_is_counted(loop):
    advance, words = loop
    rows = words[HEAD : HEAD + ROWS].view(np.float64)
    assert advance(words, 5) == 0
    rows[ROW["keep_Kclx"]], rows[ROW["add_Kclx"]] = 0.0, -100.0
    assert advance(words, 5) == 4  # the law sees in the next period what is asked for in this one
