"""``admittance-sensorless`` with an acceleration sensor: what it says of the friction that it believes."""

import numpy as np
import pytest

from baselines.bench.evaluation import evaluate, overview
from baselines.bench.pieces import controller_settings, evaluation_tasks, gathered
from baselines.named import make_controller
from birthsim_env.physics.rig.parameters import load_parameters

RIG = load_parameters("examples/acceleration_sensor_rig.toml")
CALM = RIG.replace({"friction.law": "coulomb"})


def pushed(plant, controller="admittance-sensorless"):
    law = make_controller(controller, RIG)
    found = evaluate("BirthSIM/Probe-v3", law, "mine", 2, 3, progress=False, sensors="honest", parameters=plant)
    return law.friction_trust, law.remarks(), found


def test_the_friction_of_the_plant_is_trusted_and_nothing_is_remarked():
    trust, remarks, found = pushed(RIG)
    assert trust.shape == (2, 2)
    assert (trust > 0.5).all()
    assert remarks == found.remarks == []


def test_another_law_is_found_and_the_evaluation_says_so_once():
    trust, remarks, found = pushed(CALM)
    assert (trust < 0.05).any(axis=0).all()
    assert len(found.remarks) == 1
    assert found.remarks == remarks
    assert "friction_trust" in overview([found])
    assert found.to_dict()["remarks"] == remarks


@pytest.mark.parametrize("controller", ["admittance-sensorless[identified=true]", "admittance-adaptive"])
def test_who_weighs_no_friction_trusts_the_one_believed(controller):
    trust, remarks, _ = pushed(CALM, controller)
    np.testing.assert_array_equal(trust, 1.0)
    assert remarks == []


def test_what_a_piece_remarks_reaches_the_evaluation_that_pieces_make_up():
    world = {"sensors": "honest", "parameters": CALM.to_dict()}
    own = controller_settings("admittance-sensorless", RIG)
    tasks = evaluation_tasks("mine", own, "BirthSIM/Probe-v3", world, 2, 3)
    results = [task.work(**task.settings) for task in tasks]
    assert gathered("mine", [*results, *results]).remarks == pushed(CALM)[1]


def test_a_limiter_hands_on_what_its_law_remarks():
    law = make_controller("limited:admittance-sensorless", RIG)
    found = evaluate("BirthSIM/Probe-v3", law, "mine", 2, 3, progress=False, sensors="honest", parameters=CALM)
    assert found.remarks == law.remarks() == pushed(CALM)[1]
