"""The plant against the second model: other coordinates, other states, another integrator, the same motion."""

import numpy as np
import pytest

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.lanes import SPOOLS, Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR
from birthsim_env.physics.runge_kutta import STAGES
from birthsim_env.physics.step import STEP
from lab.studies.accuracy.motions import PERIOD, PERIODS, Motion, smooth, stick_slip, strong
from lab.studies.accuracy.second_model import SecondModel
from tests.physics.rigs import DEMANDING, LAWS, OTHER, PRESSED, UNLIKE

COULOMB, ELASTO_PLASTIC = {"friction.law": "coulomb"}, {"friction.law": "elasto_plastic"}
LATE_BREAKAWAY = {**ELASTO_PLASTIC, "friction.breakaway_ratio": 0.9}


def start(
    rig: Parameters,
    speed: tuple[float, float] = (0.0, 0.0),
    spools: Array | None = None,
    relaxation_limit: float = np.inf,
) -> tuple[Plant, SecondModel]:
    plant = Plant(rig)
    plant.state[:] = balanced_state(plant.lane_parameters, np.zeros((2, 1)), np.array(speed)[:, None])
    plant.state[list(SPOOLS), 0] = 0.0 if spools is None else spools
    return plant, SecondModel(rig, plant.end_effector()[:, 0], plant.state[:, 0], relaxation_limit)


def differences(rig: Parameters, sequence: Motion, relaxation_limit: float) -> tuple[Array, Array, Array]:
    """Largest difference in position (m) and pressure (relative) at every 10 ms of ``Plant.advance`` as it is, and of its
    kernel with steps of a sixteenth; speeds of both pistons there."""
    (plant, model), (fine, _) = start(rig, relaxation_limit=relaxation_limit), start(rig)
    worst, finer, speeds = np.zeros(2), np.zeros(2), []
    steps = 16 * round(PERIOD / dynamics.INTEGRATION_STEP)
    for k in range(PERIODS):
        command, push = sequence(k)
        model.advance(command, push, PERIOD)
        plant.advance(command[:, None], push[:, None], PERIOD)
        at = command[:, None].copy(), push[None, :, None].copy(), fine.lane_parameters, steps, PERIOD / steps
        dynamics.advance(fine.state, *at, fine.impacts)
        for one, found in ((plant, worst), (fine, finer)):
            assert np.all(one.impacts == 0), "the second model has no end stops"
            position = np.abs(one.end_effector()[:2, 0] - model.state[:2]).max()
            found[:] = np.maximum(found, [position, np.abs(one.pressures[:, 0] / model.pressures - 1).max()])
        speeds.append(plant.piston_speed[:, 0])
    return worst, finer, np.array(speeds)


SOFT, STIFF = {"friction.bristle_stiffness": 5e3}, {"friction.bristle_stiffness": 5e5}
"""Ends of the two decades over which bristles may be drawn; the relaxation limit holds stiff ones from 0.1 m/s on."""
UNPRESSED = {"cylinder1.pressure_friction": 0.0, "cylinder2.pressure_friction": 0.0}
HELD = {"lugre": STEP.relaxation_limit, "elasto_plastic": STEP.elasto_plastic_limit, "coulomb": np.inf}

CASES = {
    # Position (m) and pressure (relative), about twice what was measured. Where a spool leaves its overlap the flow has a
    # corner, which costs a step accuracy: linear valves come up to six times nearer in the strong motion. The corners of
    # sign(v) in (4) cost more.
    "default, stick-slip": ({}, stick_slip, (2.3e-6, 9e-6)),
    "default, strong": ({}, strong, (1.2e-6, 7e-6)),
    "other rig, stick-slip": (OTHER, stick_slip, (1.5e-6, 1e-5)),
    "other rig, strong": (OTHER, strong, (5e-7, 3e-6)),
    "demanding rig, strong": (DEMANDING, strong, (3e-6, 1.8e-5)),
    "demanding rig, linear valves, strong": ({**DEMANDING, **LINEAR.changes()}, strong, (5e-7, 6e-6)),
    "linear valves, strong": (LINEAR.changes(), strong, (7e-7, 2.5e-6)),
    "linear valves, seals not pressed, strong": ({**LINEAR.changes(), **UNPRESSED}, strong, (3e-7, 2e-6)),
    "unlike valves, strong": (UNLIKE, strong, (1e-6, 7e-6)),
    "elasto-plastic, stick-slip": (ELASTO_PLASTIC, stick_slip, (2.8e-6, 1.1e-5)),
    "elasto-plastic, other rig, strong": ({**OTHER, **LATE_BREAKAWAY}, strong, (3.3e-6, 1.4e-5)),
    "elasto-plastic, demanding rig, strong": ({**DEMANDING, **ELASTO_PLASTIC}, strong, (3e-6, 1.8e-5)),
    "Coulomb, stick-slip": (COULOMB, stick_slip, (2.6e-6, 1.1e-5)),
    "Coulomb, strong": (COULOMB, strong, (2e-5, 1.4e-4)),
    "pressed seals, stick-slip": (PRESSED, stick_slip, (2.2e-6, 9e-6)),
    "pressed seals, elasto-plastic, strong": ({**PRESSED, **ELASTO_PLASTIC}, strong, (1.1e-6, 7e-6)),
    "soft bristles, strong": (SOFT, strong, (1.2e-6, 6e-6)),
    "stiff bristles, stick-slip": (STIFF, stick_slip, (3.4e-6, 1.5e-5)),
    "stiff bristles, strong": (STIFF, strong, (2e-6, 1e-5)),
    "stiff bristles, elasto-plastic, strong": ({**STIFF, **ELASTO_PLASTIC}, strong, (1.3e-5, 8e-5)),
}


@pytest.mark.parametrize("name", CASES)
def test_plant_moves_like_the_second_model(name: str) -> None:
    """Smaller steps come much nearer, so that the step alone is what differs."""
    changes, sequence, allowed = CASES[name]
    rig = Parameters().replace(changes)
    worst, finer, speeds = differences(rig, sequence, HELD[rig.friction.law])
    assert np.all(worst < allowed), worst
    # Corners of sign(v), of which there are many, cost steps of a sixteenth some accuracy too.
    assert np.all(finer < ((5e-8, 3e-7) if rig.friction.law == "coulomb" else (1e-8, 4e-8))), finer
    assert np.all(finer < worst / 40), (worst, finer)
    if sequence is stick_slip:
        assert np.all((np.abs(speeds) < 1e-3).mean(axis=0) > 0.05), "must stick at times"
        assert np.all(np.abs(speeds).max(axis=0) > 0.01), "must slip at times"
    else:
        assert np.all(np.abs(speeds).max(axis=0) > [0.5, 0.7])


@pytest.mark.parametrize(("law", "allowed"), [("lugre", (8e-6, 2e-5)), ("elasto_plastic", (1.3e-5, 8e-5))])
def test_held_relaxation_of_stiff_bristles_costs_micrometres(law: str, allowed: tuple[float, float]) -> None:
    """A sliding bristle that is held follows the pressures behind its level late, by milliseconds."""
    worst, finer, _ = differences(Parameters().replace({**STIFF, "friction.law": law}), strong, np.inf)
    assert np.all(worst < allowed), worst
    assert np.all(finer > 5e-7), "smaller steps do not mend it"


@pytest.mark.parametrize("law", LAWS)
def test_the_methods_order_where_the_motion_is_smooth(law: str) -> None:
    """No reversal, no spool in its overlap, no pressure ratio through 0.3 or 0.99: halving the step leaves 1/8 of the error."""
    rig = Parameters().replace({"friction.law": law})
    command, push = smooth(0)
    errors = []
    for steps in (20, 40, 80):
        plant, model = start(rig, (0.12, -0.2), command)
        at = command[:, None].copy(), push[None, :, None].copy(), plant.lane_parameters, steps, 0.04 / steps
        dynamics.advance(plant.state, *at, plant.impacts)
        model.advance(command, push, 0.04)
        errors.append(np.abs(plant.end_effector()[:3, 0] - model.state[:3]).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(np.abs(orders - STAGES) < 0.25), orders
    assert errors[-1] < 5e-8
