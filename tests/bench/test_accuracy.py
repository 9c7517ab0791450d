"""Accuracy of the plant: what is measured, the tables and the figure, and that the plant's step keeps its error small."""

import json
import math

import numpy as np
import pytest

from birthsim_env.physics import dynamics
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.accuracy import errors as accuracy
from lab.studies.accuracy import tables as accuracy_tables
from lab.studies.accuracy.figure import accuracy_figure
from lab.studies.accuracy.motions import MOTIONS, strong


@pytest.mark.parametrize(("method", "order"), accuracy.EVALUATIONS.items())
def test_a_method_has_its_order_on_a_spool(method, order):
    """The spools alone are a linear lag, whose solution is known: a step multiplies the rest by a piece of its series."""
    plant = accuracy.start([Parameters()], (0.0, 0.0))
    command, push = np.full((4, 1), 0.5), np.zeros((2, 1))
    accuracy.METHODS[method](plant, command, push, 0.004, 0.001)
    series = sum((-0.25) ** k / math.factorial(k) for k in range(order + 1))
    np.testing.assert_allclose(plant.state[14:], 0.5 * (1 - series**4), rtol=1e-12)


def test_the_plants_own_step_errs_far_less_than_a_tracker():
    """Strong motion of the nominal and the quickest rig; a laboratory's position noise is 100 um."""
    rigs = list(accuracy.rigs_to_measure(Parameters(), 1, 0).values())[:2]
    course = accuracy.run_method(rigs, strong, accuracy.runge_kutta, dynamics.INTEGRATION_STEP)
    reference = accuracy.joined(accuracy.run_reference(rig, strong)[0] for rig in rigs)
    position, pressure = accuracy.errors(course, reference)
    assert course.clear.all()
    assert np.all(position < [1.2e-6, 4e-6]), position
    assert np.all(pressure < [7e-6, 1.8e-5]), pressure


@pytest.fixture(scope="module")
def found():
    patch = pytest.MonkeyPatch()
    with patch.context() as short:
        for name, value in (("TOLERANCES", (1e-4,)), ("ADAPTIVE", ("RK45", "DOP853", "Radau")), ("LAWS", ("lugre",))):
            short.setattr(accuracy, name, value)
        rigs = {name: rig for name, rig in accuracy.rigs_to_measure(Parameters(), 1, 0).items() if "corner 1" not in name}
        measured = accuracy.measure(rigs, MOTIONS)
    from birthsim_env.files import finite

    return json.loads(json.dumps(finite(measured), allow_nan=False))


def test_a_measurement_says_everything(found):
    assert found["rigs"] == ["nominal", "quick corner", "slow corner", "draw 1"]
    assert found["motions"]["strong"]["clear_of_stops"][2] is False, "the slow corner runs into its stop"
    for name in MOTIONS:
        measured = found["motions"][name]
        rows = measured["methods"][accuracy.SHIPPED]["position_m"]
        assert np.array(rows).shape == (5, 4)
        falling = np.array(rows, dtype=float)[:, 0]
        # Where in its step a spool leaves the overlap is a matter of chance, so that not every smaller step is nearer.
        assert falling[4] < 0.1 * falling[2] < 0.1 * falling[0], "smaller steps, smaller errors"
        assert measured["reference_itself"]["position_m"] < 0.1 * falling[2]
    orders = found["smooth"]["orders"][accuracy.SHIPPED]
    assert orders == pytest.approx([accuracy.EVALUATIONS[accuracy.SHIPPED]] * 4, abs=0.25), "stiff bristles too"


def test_tables_show_the_plants_row_and_what_is_unstable(found, tmp_path):
    text = accuracy_tables.tables(found)
    assert 'Motion "strong", 3 of 4 rigs' in text
    assert text.count(f"**{accuracy.SHIPPED}, the plant's**") == 2
    position, pressure, rig = accuracy_tables.worst(found, "strong")
    assert 1e-9 < position < 4e-6
    assert 1e-9 < pressure < 1.8e-5
    assert rig in found["rigs"]
    assert rig != "slow corner"
    assert accuracy_tables.number(None) == "unstable" == accuracy_tables.number(math.inf)
    assert [accuracy_tables.number(v) for v in (12.3, 0.0123, 1.2e5)] == ["12.3", "0.0123", "120,000"]
    assert {path.name for path in accuracy_figure(found, tmp_path)} == {"accuracy.png", "accuracy.svg"}
