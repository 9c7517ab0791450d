"""One cylinder on a rail: against a model of its own from energy, and against what a locked cylinder must not do."""

import math

import numpy as np
import pytest

from baselines.named import make_controller
from birthsim_env.loop.signals import REFERENCES, Measurement, Reference
from birthsim_env.physics import dynamics, options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.step import STEP
from tests.oracles.one_cylinder import OneCylinder

TILTS = (0.0, 30.0, 90.0)
"""Degrees."""

OWN = {
    "cylinder2.piston_diameter": 0.032, "cylinder2.rod_diameter": 0.012, "cylinder2.stroke": 0.3, "mechanics.mass": 4.3,
    "valve_p2.supply_overlap": 0.03, "valve_n2.exhaust_curvature": -0.1, "cylinder2.direction_asymmetry": 0.15,
}  # fmt: skip
"""A bench of its own."""

FINE = 160
"""Steps of the plant a period, so that its method's error does not count."""

PERIOD = 1e-3
"""s."""


def rail(tilt: float, changes: dict[str, object] | None = None) -> Parameters:
    """A rig on a rail ``tilt`` degrees above x."""
    return Parameters().replace({"linkage.kind": "rail", "linkage.inclination": math.radians(tilt), **(changes or {})})


class Pair:
    """A plant and the oracle of one rig, side by side under the same openings and push."""

    def __init__(self, rig: Parameters) -> None:
        self.rig, self.plant = rig, Plant(rig)
        self.plant.state[at.Y1] = 0.0
        self.oracle = OneCylinder(rig, 0.0, self.plant.pressures[2:, 0], STEP.relaxation_limit)
        along = rig.linkage.inclination
        self.direction = np.array([math.cos(along), math.sin(along)])
        self.apart = 0.0

    def advance(self, openings: Array, push: float, across: float) -> None:
        """One period under openings (4,) of all valves, a push along the rail and one across it, N."""
        force = push * self.direction + across * np.array([-self.direction[1], self.direction[0]])
        at_rest = openings[:, None].copy(), force[None, :, None].copy(), self.plant.lane_parameters
        dynamics.advance(self.plant.state, *at_rest, FINE, PERIOD / FINE, self.plant.impacts)
        self.oracle.advance(openings[2:], push, PERIOD)
        self.apart = max(self.apart, abs(self.plant.state[at.Y2, 0] - self.oracle.state[0]))

    def measurement(self, time: float, place: float, speed: float, pressures: Array) -> Measurement:
        """What ideal sensors show of a carriage."""
        position, now = (self.rig.geometry.k2 + place) * self.direction, np.array([time])
        chambers = np.concatenate([self.plant.pressures[:2, 0], pressures])[:, None]
        velocity = (speed * self.direction)[:, None]
        return Measurement(now, position[:, None], now, velocity, chambers, np.zeros((2, 1)), False)


@pytest.mark.parametrize("tilt", TILTS)
def test_a_rail_moves_like_one_cylinder_by_its_energies(tilt: float) -> None:
    """2 s of random openings of all four valves, pushed along and across: 1e-8 m, and cylinder 1 does not stir."""
    pair, rng = Pair(rail(tilt, OWN)), np.random.default_rng(int(tilt))
    still = pair.plant.state[[at.Y1, at.V1, at.Z1, *at.PRESSURES[:2], *at.TEMPERATURES[:2], at.S1P, at.S1N]].copy()
    moved = []
    weight = pair.rig.mechanics.mass * 9.81 * math.sin(math.radians(tilt))
    for k in range(2000):
        if k % 100 == 0:
            # Along the stroke and back, whatever the weight: towards the middle where it is far from it.
            side = -math.copysign(1.0, pair.oracle.state[0])
            openings, push = side * rng.uniform(-0.1, 0.4, 4) * [1, -1, 1, -1], rng.uniform(-20.0, 20.0) + 0.2 * weight
        pair.advance(openings, push, 300.0)
        moved.append(pair.oracle.state[0])
    assert np.ptp(moved) > 0.05, "must move"
    assert np.all(pair.plant.impacts == 0), "the oracle has no end stops"
    assert pair.apart < 1e-8
    now = pair.plant.state[[at.Y1, at.V1, at.Z1, *at.PRESSURES[:2], *at.TEMPERATURES[:2], at.S1P, at.S1N]]
    np.testing.assert_allclose(now, still, rtol=1e-12, atol=0)
    assert np.abs(pair.plant.end_effector()[:2, 0] @ [-pair.direction[1], pair.direction[0]]) < 1e-15


@pytest.mark.parametrize("tilt", [30.0, *(pytest.param(tilt, marks=pytest.mark.weekly) for tilt in (0.0, 90.0))])
def test_a_rail_under_a_controller_moves_like_one_cylinder(tilt: float) -> None:
    """Either has a copy of the controller, which sees it alone: the loops stay together for 2 s."""
    rig = rail(tilt)
    pair, copies = Pair(rig), [make_controller("backstepping", rig) for _ in range(2)]
    reference = Reference(np.zeros((REFERENCES, 1)))
    reference.stiffness[:], reference.pneumatic_stiffness[:] = 2000.0, [[4400.0], [2200.0]]
    for k in range(2000):
        rate = 2 * np.pi / 2.0
        wave = [0.05 * rate**n * math.sin(rate * 1e-3 * k + n * np.pi / 2) for n in range(4)]
        for rows, value, middle in zip(
            (reference.position, reference.velocity, reference.acceleration, reference.jerk), wave, (0.5, 0, 0, 0), strict=True
        ):
            rows[:] = (pair.direction * (middle + value))[:, None]
        plant, oracle = pair.plant, pair.oracle
        seen = [
            pair.measurement(1e-3 * k, plant.state[at.Y2, 0], plant.state[at.V2, 0], plant.pressures[2:, 0]),
            pair.measurement(1e-3 * k, oracle.state[0], oracle.speed, oracle.pressures),
        ]
        openings = [copy.command(one, reference)[:, 0] for copy, one in zip(copies, seen, strict=True)]
        push = 10.0 if 500 < k < 1500 else 0.0
        force = (push * pair.direction)[None, :, None].copy()
        dynamics.advance(
            plant.state, openings[0][:, None].copy(), force, plant.lane_parameters, FINE, PERIOD / FINE, plant.impacts
        )
        oracle.advance(openings[1][2:], push, PERIOD)
        pair.apart = max(pair.apart, abs(plant.state[at.Y2, 0] - oracle.state[0]))
    assert abs(oracle.state[0] - wave[0]) < 0.02, "must follow"
    assert pair.apart < 1e-8


def test_a_rail_with_every_option_keeps_its_first_cylinder_still() -> None:
    """Tubes, a supply line and a soft structure: nothing flows through idle valves, nothing moves across the rail."""
    changes = {"chambers.tube_length": 0.5, "air.supply_conductance": 4e-9, "mechanics.mode_frequency": 25.0}
    plant = Plant(rail(30.0, changes))
    before = plant.state.copy()
    plant.advance(np.array([[0.8], [-0.8], [0.6], [-0.6]]), np.array([[20.0], [-40.0]]), 0.2)
    assert plant.state[at.Y2, 0] - before[at.Y2, 0] > 0.005
    idle = [at.Y1, at.V1, at.PP1, at.PN1, at.S1P, at.S1N]
    np.testing.assert_allclose(plant.state[idle], before[idle], rtol=1e-12, atol=0)
    flows = np.empty((8, 1))
    options.mass_flows(plant.state, plant.memory[4:], plant.lane_parameters, flows)
    assert np.all(flows[[0, 1, 4, 5]] == 0.0)
    assert np.all(flows[[2, 3, 6, 7]] != 0.0)


def test_a_file_of_a_rail_has_no_first_cylinder(tmp_path) -> None:
    rig = rail(30.0, OWN)
    rig.to_toml(tmp_path / "rail.toml")
    assert Parameters.from_toml(tmp_path / "rail.toml") == rig
    assert not {"cylinder1", "valve_p1", "valve_n1"} & set(rig.to_dict(options=True))
    assert rig.replace({"linkage.inclination": 0.0}).geometry.gamma3 == math.pi / 2


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"linkage.kind": "rial"}, ("kind", "rial", "rail")),
        ({"linkage.kind": "rail", "linkage.inclination": 2.0}, ("inclination", "2.0", "1.57")),
        ({"linkage.kind": "rail", "geometry.gamma3": 1.0}, ("gamma3", "1.0", "inclination")),
        ({"linkage.kind": "rail", "cylinder2.stroke": -1.0}, ("stroke", "-1.0")),
    ],
)
def test_an_impossible_rail_is_refused_by_name(changes: dict[str, object], named: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match=named[0]) as refused:
        Parameters().replace(changes)
    assert all(word in str(refused.value) for word in named)
