"""What the law renders on the whole plant without dry friction: stiffness, and setpoints that change."""

import numpy as np
import pytest

from baselines import BacksteppingController
from baselines.bench.probes import run_stiffness_test
from baselines.named import make_controller
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop
from tests.oracles.closed_loop import FRICTIONLESS

ANOTHER = FRICTIONLESS.replace(
    {
        "mechanics.mass": 2.0,
        "cylinder1.viscous_friction": 10.0,
        "cylinder2.viscous_friction": 60.0,
        "chambers.dead_volume": 25e-6,
        "valves.time_constant": 0.002,
    }
)


@pytest.mark.parametrize(
    ("name", "rig"),
    [("backstepping-weight", FRICTIONLESS), ("backstepping-weight", ANOTHER), ("backstepping-one-valve", FRICTIONLESS)],
    ids=["default", "another rig", "one valve"],
)
def test_rendered_stiffness_is_the_setpoint(name: str, rig: Parameters, monkeypatch: pytest.MonkeyPatch) -> None:
    """5 mm either way at 5 poses, both axes: each within 1 %, the mean of both ways, without the linkage's turning, 0.2 %."""
    closed_loop.shorten_probes(monkeypatch)
    probes = closed_loop.pushes((0.005, -0.005), rigs=(rig,))
    probes.force[:] *= probes.stiffness[0]
    answers = run_stiffness_test(probes, make_controller(name, rig))
    error = answers.stiffness_error(probes.force)
    assert np.abs(answers.displacement[probes.force == 0]).max() < 0.01 * 0.005
    assert np.abs(error).max() < 0.01
    assert np.abs(error.reshape(-1, 2).mean(axis=1)).max() < 0.002
    assert answers.hunting.max() < 1e-5


@pytest.mark.parametrize("ratio", [None, 1.2])
def test_the_setpoint_may_change_under_force(ratio: float | None) -> None:
    """From 2000 to 4000 N/m within one control period and back, pushed with 10 N on each axis: half the displacement."""
    plan = {0: 2000.0, 2: 4000.0, 4: 2000.0}
    position, push = np.array([[0.5], [0.0]]), np.full((2, 1), 10.0)
    references = {second: closed_loop.holding(position, setpoint) for second, setpoint in plan.items()}
    plant = closed_loop.resting_at(references[0], FRICTIONLESS)
    law, path = BacksteppingController(FRICTIONLESS, weight_compensation=True, damping_ratio=ratio), []
    for _ in closed_loop.run(plant, law.command, lambda t: references[int(t // 2) * 2], lambda t: push * min(t, 1.0), 6.0):
        path.append((plant.end_effector()[:2] - position)[:, 0])
    np.testing.assert_allclose([path[1999], path[5999]], 0.005, rtol=0.01)
    np.testing.assert_allclose([path[2500], path[3999]], 0.0025, rtol=0.01)
    later = np.array(path[2000:])
    assert np.all(later > 0.99 * path[3999]), "no overshoot"
    assert np.all(later < 1.01 * path[1999]), "no shock"
