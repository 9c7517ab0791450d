"""The law whose dF*/dt leaves the Coulomb friction out: what it renders where the plant has LuGre friction."""

import numpy as np
import pytest

from baselines import BacksteppingController
from baselines.bench.probes import POSES, StiffnessTest, run_stiffness_test
from baselines.registry import make_controller
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop

CASES = [(pose, setpoint, axis) for pose in POSES for setpoint in (1000.0, 2000.0, 4000.0) for axis in (0, 1)]


def test_it_renders_the_setpoint_where_the_papers_law_is_too_stiff(monkeypatch: pytest.MonkeyPatch) -> None:
    """20 N, 12 and 15 N of Coulomb friction, exact sensors, 30 probes: errors and hunting of both laws."""
    closed_loop.shorten_probes(monkeypatch)
    poses, setpoints, axes = (np.array(column) for column in zip(*CASES, strict=True))
    force = 20.0 * (axes == np.array([[0], [1]]))
    probes = StiffnessTest(np.ascontiguousarray(poses.T), force, np.stack([setpoints, setpoints, 0 * setpoints]), Parameters())
    paper, frozen = (
        run_stiffness_test(probes, make_controller(name, Parameters()))
        for name in ("backstepping-weight", "backstepping-frozen")
    )
    assert not frozen.lost.any()
    assert np.median(paper.stiffness_error(force)) > 0.15, "too stiff"
    assert np.median(np.abs(frozen.stiffness_error(force))) < 0.02
    assert np.abs(frozen.stiffness_error(force)).max() < 0.1
    hunting = np.median(frozen.hunting.max(axis=0)), np.median(paper.hunting.max(axis=0))
    assert hunting[0] < 0.6 * hunting[1]
    assert hunting[0] > 0.0005, "it still hunts, which is why there are better laws"


def test_its_name_compensates_for_the_weight() -> None:
    law = make_controller("backstepping-frozen", Parameters())
    assert isinstance(law, BacksteppingController)
    assert law.weight_compensation
    assert law.frozen_friction
