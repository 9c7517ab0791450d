"""The right-hand side against the second model's, state by state, and what the kernels around it do."""

import numpy as np
import pytest

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.dynamics import INTEGRATION_STEP
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.accuracy import second_model
from lab.studies.accuracy.second_model import SecondModel
from tests.physics.rigs import DEMANDING, LAWS, MOVED, OTHER, PRESSED, UNLIKE


def anywhere(rig: Parameters, lanes: int, seed: int) -> tuple[Plant, Array, Array]:
    """States within the strokes with everything in motion, commands and pushes."""
    rng, plant = np.random.default_rng(seed), Plant(rig, lanes)
    half = np.array([[rig.cylinder1.stroke / 2], [rig.cylinder2.stroke / 2]])
    s = plant.state
    s[[at.Y1, at.Y2]] = 0.95 * half * rng.uniform(-1, 1, (2, lanes))
    s[[at.V1, at.V2]] = rng.choice([0.0005, 0.02, 0.8], (2, lanes)) * rng.normal(0, 1, (2, lanes))
    s[[at.Z1, at.Z2]] = rng.uniform(-4e-4, 4e-4, (2, lanes))
    s[list(at.PRESSURES)] = rng.uniform(0.9e5, 7.5e5, (4, lanes))
    s[list(at.TEMPERATURES)] = rng.uniform(250, 340, (4, lanes))
    s[list(at.SPOOLS)] = rng.uniform(-1, 1, (4, lanes))
    return plant, rng.uniform(-1, 1, (4, lanes)), rng.uniform(-150, 150, (2, lanes))


def shown(rig: Parameters, plant: Plant, state: Array) -> Array:
    """A state (18, N) in the second model's coordinates, (18, N)."""
    plant.state = state
    observed = plant.end_effector()
    return np.stack([SecondModel(rig, observed[:, i], state[:, i]).state for i in range(plant.num_envs)], axis=1)


def other_rates(rig: Parameters, plant: Plant, state: Array, command: Array, push: Array) -> Array:
    """What the second model has for a state (18, N), command and push, (18, N)."""
    columns = [np.ascontiguousarray(rows.T) for rows in (shown(rig, plant, state), command, push)]
    return np.stack([second_model.rates(*one, *second_model.constants(rig)) for one in zip(*columns, strict=True)], axis=1)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    "changes",
    [MOVED, OTHER, DEMANDING, UNLIKE, PRESSED],
    ids=["moved", "other", "demanding", "unlike valves", "pressed"],
)
def test_rates_are_the_second_models(changes: dict[str, object], law: str) -> None:
    """Its own rates at a state are the slope of its coordinates along the plant's rates."""
    rig = Parameters().replace({**changes, "friction.law": law})
    plant, command, push = anywhere(rig, 8, LAWS.index(law))
    state = plant.state.copy()
    rates = plant.derivatives(state, command, push)
    step = 1e-6
    slope = (shown(rig, plant, state + step * rates) - shown(rig, plant, state - step * rates)) / (2 * step)
    expected = other_rates(rig, plant, state, command, push)
    # The relaxation limit of fast bristles is the plant's own; ``friction`` has its tests.
    fast = np.abs(state[[at.V1, at.V2]]) > 0.5
    assert not np.all(fast)
    size = np.abs(expected).max(axis=1, keepdims=True) + 1e-12
    difference = np.abs(slope - expected) / size
    difference[12:14][fast] = 0.0
    slow = np.repeat(~fast.any(axis=0)[None], 4, axis=0) | (law == "coulomb")
    assert np.all(difference[[0, 1, *range(4, 18)]] < 1e-6), difference.max(axis=1)
    assert np.all(difference[:4][slow] < 1e-6), difference[:4]
    assert slow.any(axis=1).all()


def test_flows_are_those_that_change_the_air() -> None:
    """The ledger of masses: inflow less outflow of each chamber is the second model's rate of its mass."""
    rig = Parameters().replace(MOVED)
    plant, command, push = anywhere(rig, 6, 3)
    expected = other_rates(rig, plant, plant.state.copy(), command, push)
    flows = plant.mass_flows()
    np.testing.assert_allclose(flows[:4] - flows[4:], expected[4:8], rtol=1e-9, atol=1e-15)


def ralstons(plant: Plant, command: Array, push: Array, step: float) -> Array:
    """One step of third order, as Ralston has it."""
    x = plant.state.copy()
    k1 = plant.derivatives(x, command, push)
    k2 = plant.derivatives(x + step / 2 * k1, command, push)
    k3 = plant.derivatives(x + 3 * step / 4 * k2, command, push)
    return x + step / 9 * (2 * k1 + 3 * k2 + 4 * k3)


def test_a_step_is_the_textbooks_in_every_lane() -> None:
    """More lanes than a block has, two samples of the push, two steps each."""
    plant, command, push = anywhere(Parameters().replace(MOVED), BLOCK + 3, 4)
    start, step = plant.state.copy(), 1e-5
    for sample in (push, -push):
        for _ in range(2):
            plant.state = ralstons(plant, command, sample, step)
    expected = plant.state.copy()
    plant.state = start
    plant.impacts[:] = np.nan
    forces = np.stack([push, -push])
    dynamics.advance(plant.state, command, forces, plant.lane_parameters, 2, step, plant.impacts)
    np.testing.assert_allclose(plant.state, expected, rtol=1e-13, atol=1e-18)
    assert np.all(plant.impacts == 0)


@pytest.mark.parametrize("cylinder", [0, 1])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_impact_is_the_largest_speed_outward_past_the_stroke(cylinder: int, side: float) -> None:
    rig = Parameters().replace({"cylinder1.stroke": 0.15, "cylinder2.stroke": 0.15})
    plant = Plant(rig, 4)
    position, speed = ((at.Y1, at.V1), (at.Y2, at.V2))[cylinder]
    half = (rig.cylinder1.stroke / 2, rig.cylinder2.stroke / 2)[cylinder]
    # Past the stroke outward, past it inward, short of it, and in its middle.
    plant.state[position] = side * np.array([half + 1e-5, half + 1e-4, half - 1e-3, 0.0])
    plant.state[speed] = side * np.array([0.2, -0.2, 0.2, 0.2])
    dynamics.advance(plant.state, np.zeros((4, 4)), np.zeros((1, 2, 4)), plant.lane_parameters, 3, 1e-6, plant.impacts)
    assert plant.impacts[cylinder, 0] == pytest.approx(0.2, rel=0.02)
    assert plant.impacts[cylinder, 0] > plant.state[speed, 0] * side, "it is the first step's: the stop has slowed it since"
    assert np.all(plant.impacts[cylinder, 1:] == 0)
    assert np.all(plant.impacts[1 - cylinder] == 0)


def test_what_has_decayed_becomes_zero_and_nothing_else_does() -> None:
    plant = Plant(num_envs=3)
    plant.state[at.S1P] = 1e-29, 1e-31, -1e-31
    before = plant.state.copy()
    dynamics.advance(plant.state, np.zeros((4, 3)), np.zeros((1, 2, 3)), plant.lane_parameters, 1, 1e-9, plant.impacts)
    np.testing.assert_array_equal(plant.state[at.S1P, 1:], 0.0)
    assert plant.state[at.S1P, 0] == pytest.approx(1e-29, rel=1e-5)
    np.testing.assert_allclose(plant.state[at.PP1], before[at.PP1], rtol=1e-6)
    plant.state[at.S1P] = -1e-29
    dynamics.advance(plant.state, np.zeros((4, 3)), np.zeros((1, 2, 3)), plant.lane_parameters, 1, 1e-9, plant.impacts)
    assert plant.state[at.S1P, 0] == pytest.approx(-1e-29, rel=1e-5)


@pytest.mark.parametrize(
    ("times", "steps"), [(1.0, 1), (4.0, 4), (1.04, 2), (0.4, 1), (1e-9, 1), (1 + 1e-12, 1), (3 - 1e-12, 3)]
)
def test_steps_are_no_longer_than_the_default(times: float, steps: int) -> None:
    assert dynamics.steps_in(times * INTEGRATION_STEP) == steps


def test_a_control_period_has_a_whole_number_of_the_default() -> None:
    assert dynamics.steps_in(1e-3) * INTEGRATION_STEP == pytest.approx(1e-3, rel=1e-15)
