"""The study of errors on a rail: what it asks for, what a known error becomes, and what its table says."""

from types import SimpleNamespace

import numpy as np
import pytest

import birthsim
from birthsim_env.physics.rig.parameters import Parameters
from lab.engine.worlds import COUNT, SEED
from lab.studies.rail_error import CONTROLLERS, STUDY, TILTS, measure, rail

OPTIONS = SimpleNamespace(**{**STUDY.options, "episodes": 3})


def test_every_controller_meets_the_same_worlds_at_every_inclination():
    tasks = STUDY.tasks(OPTIONS)
    assert list(tasks) == [(controller, tilt) for controller in CONTROLLERS for tilt in TILTS]
    assert len({task.name for task in tasks.values()}) == len(tasks)
    for (_, tilt), task in tasks.items():
        assert Parameters.from_dict(task.settings["rig"]) == rail(tilt)
        assert task.settings["seed"] == STUDY.options["seed"]
        assert not SEED <= task.settings["seed"] < SEED + COUNT


def test_a_lost_episode_counts_as_the_worst():
    fine = {"error": [1.0, 2.0, 3.0], "stiffness": [4.0, 4.0, 4.0], "hunting": [0.1] * 3, "lost": [False] * 3}
    bad = {"error": [1.0, None, None], "stiffness": [5.0, 6.0, None], "hunting": [0.1] * 3, "lost": [False, True, True]}
    found = {(name, tilt): bad if (name, tilt) == ("pid", 90.0) else fine for name in CONTROLLERS for tilt in TILTS}
    content = {"figures": STUDY.keep(OPTIONS, found), "settings": vars(OPTIONS), "units": STUDY.units}
    said = STUDY.show(content)["rail-error.md"].splitlines()
    cells = [cell for one in said if one.startswith("| `pid`") for cell in one.strip("| ").split(" | ")[4:]]
    assert cells == [
        *(["2.00", "2.90"] * 2),
        "lost",
        "lost",
        *(["4.00"] * 4),
        "6.00",
        "lost",
        *(["0.100"] * 6),
        "0",
        "0",
        "2",
    ]


@pytest.mark.parametrize("controller", ["pid"])
def test_errors_are_those_of_an_evaluation_and_of_a_push_that_is_watched(controller):
    """One world: the settled error as ``birthsim.evaluate`` has it, and the stiffness from a push in the environment."""
    (task,) = (one for key, one in STUDY.tasks(OPTIONS).items() if key == (controller, 30.0))
    found = measure(**{**task.settings, "seed": 50, "lanes": 1})
    bench = rail(30.0)
    shared = {"parameters": bench, "sensors": "encoders", "randomize": True}
    own = birthsim.evaluate("BirthSIM/Rail-v0", controller, episodes=1, seed=50, progress=False, **shared)
    assert found["error"] == [own.settled_error()["median"]]
    assert found["lost"] == [False]
    assert 0.0 < found["stiffness"][0] < 20.0
    assert np.isfinite(found["stiffness"]).all()
