"""What acts on a built loop from outside: setpoints and forces that pass over, another law, parts that are left out.

That a person's hand and setpoints give the bits of the same in Python, ``tests/live/rig/test_bits.py`` shows.
"""

import numpy as np
import pytest

from birthsim_build.image import HEAD, LEFT_OUT
from birthsim_build.layout import ROWS
from birthsim_build.stages import FORCE_TIME, SETPOINTS_TIME
from lab.studies.targets.reference import PERIODS, SHARED, loop_rows
from lab.studies.targets.running import ROW, library_loop
from tests.build.targets import assert_same_bits

LOOP = {"scenario": "circle", "sensors": "ideal", "controller": "admittance-backstepping"}


def test_setpoints_and_a_hand_s_force_pass_over(in_node):
    at, since = 1300, (np.arange(PERIODS) - 1300) * 1e-3  # a push of the scenario is on
    later, once = np.where(since >= 0, 0.0, 1.0), np.where(since == 0, 1.0, 0.0)
    inputs = {"keep_Kclx": later, "keep_force": later, "pass_setpoints": once, "pass_force": once}
    rows = in_node("", "loop", LOOP, inputs={**inputs, "add_Kclx": np.where(since >= 0, 3000.0, 0.0)})
    stiffness, force = rows[:, ROW["reference_Kclx"]], rows[:, ROW["force_x"]]
    assert force[at - 1] > 1
    assert (stiffness[at], force[at]) == (stiffness[at - 1], force[at - 1])
    for found, start, end, lasts in ((stiffness, 2000.0, 3000.0, SETPOINTS_TIME), (force, force[at - 1], 0.0, FORCE_TIME)):
        u = np.clip(since / lasts, 0.0, 1.0)[at:]
        passed = u**3 * (10 - 15 * u + 6 * u * u)
        assert found[at:] == pytest.approx(start + passed * (end - start), rel=1e-9, abs=1e-9)
        assert found[-1] == end


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_another_law_takes_over(in_node, sensors):
    exchange = {"at": 777, "controller": "residual:circle", "sensors": sensors}
    rows = in_node("", "loop", {**LOOP, "sensors": sensors}, exchange=exchange)
    assert_same_bits(rows[:, SHARED], loop_rows("circle", sensors, LOOP["controller"], exchange=exchange)[:, SHARED])


@pytest.fixture
def loop(library):
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


@pytest.mark.parametrize("name", ["add_x", "add_Kclx", "add_force_x", "pointer_x", "pointer_stiffness", "push_y"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_an_input_that_is_not_finite_is_counted_and_changes_nothing_for_good(loop, name, value):
    advance, words = loop
    rows = words[HEAD : HEAD + ROWS].view(np.float64)
    rows[ROW["pointer_x"]], rows[ROW["pointer_y"]], rows[ROW["pointer_held"]] = 0.5, 0.0, 1.0
    assert advance(words, 50) == 0
    before, rows[ROW[name]] = rows[ROW[name]], value
    assert advance(words, 20) >= (20 if np.isnan(value) else 0)
    assert np.isfinite(rows[[ROW["x"], ROW["y"], ROW["force_x"], ROW["opening_P1"], ROW["reference_Kclx"]]]).all()
    rows[ROW[name]] = before
    assert advance(words, 50) == 0
    assert np.isfinite(rows[[ROW["x"], ROW["y"], ROW["force_x"], ROW["opening_P1"], ROW["reference_Kclx"]]]).all()
