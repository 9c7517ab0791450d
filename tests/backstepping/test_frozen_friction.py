"""The law whose dF*/dt leaves the Coulomb friction out: what it renders where the plant has LuGre friction."""

import numpy as np
import pytest

from baselines.bench.probes import run_stiffness_test
from baselines.registry import make_controller
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop


def test_it_renders_the_setpoint_where_the_papers_law_is_too_stiff(monkeypatch: pytest.MonkeyPatch) -> None:
    """20 N, 12 and 15 N of Coulomb friction, exact sensors, 30 probes: errors and hunting of both laws."""
    closed_loop.shorten_probes(monkeypatch)
    probes = closed_loop.pushes((20.0,))
    paper, frozen = (
        run_stiffness_test(probes, make_controller(name, Parameters()))
        for name in ("backstepping-weight", "backstepping-frozen")
    )
    assert not frozen.lost.any()
    assert np.median(paper.stiffness_error(probes.force)) > 0.15, "too stiff"
    assert np.median(np.abs(frozen.stiffness_error(probes.force))) < 0.02
    assert np.abs(frozen.stiffness_error(probes.force)).max() < 0.1
    hunting = np.median(frozen.hunting.max(axis=0)), np.median(paper.hunting.max(axis=0))
    assert 0.0005 < hunting[0] < 0.6 * hunting[1], "it still hunts, which is why there are better laws"
