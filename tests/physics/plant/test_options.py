"""Options of the plant: against the second model with a reservoir and a second body, closed forms, the plain plant."""

import math

import gymnasium
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from birthsim_env.parts.drawn.randomization import checked_ranges, documented_ranges
from birthsim_env.physics import options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.dynamics import INTEGRATION_STEP
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import DECLARED, Parameters
from birthsim_env.physics.runge_kutta import STAGES
from lab.studies.accuracy import second_model
from lab.studies.accuracy.motions import PERIOD, strong
from lab.studies.accuracy.second_model import SCALES, SecondModel

CIRCLE = "BirthSIM/Circle-v1"
LINE = {"air.supply_conductance": 4e-9, "air.supply_volume": 1e-4}
TUBE = {"chambers.tube_length": 1.0}
HANDLE = {"mechanics.mode_frequency": 25.0, "mechanics.mode_damping": 0.05, "mechanics.mode_mass_fraction": 0.3}
EACH = {"line": LINE, "tube": TUBE, "handle": HANDLE, "all": {**LINE, **TUBE, **HANDLE}}
WORTH = {name: one.range for name, one in DECLARED.items() if one.on_request}


class OtherOptions:
    """The second model with a reservoir, kept by its mass of air, and a handle, a body with weight of its own on a spring."""

    def __init__(self, rig, plant):
        self.rig, m = rig, rig.mechanics
        self.handle = m.mass * m.mode_mass_fraction if m.mode_frequency else 0.0
        self.spring = self.handle * (2 * math.pi * m.mode_frequency) ** 2
        self.damper = 2 * m.mode_damping * math.sqrt(self.spring * self.handle)
        self.sag = np.array([0.0, -self.handle * m.gravity / self.spring]) if self.handle else np.zeros(2)
        self.inner = SecondModel(
            rig.replace({"mechanics.mass": m.mass - self.handle}), plant.end_effector()[:, 0], plant.state[:, 0]
        )
        air = rig.air
        self.reservoir = air.supply_pressure * air.supply_volume / (air.gas_constant * air.temperature)
        self.body = np.concatenate([plant.end_effector()[:2, 0] + self.sag, plant.end_effector()[2:, 0]])

    def pressure(self, mass):
        return mass * self.rig.air.gas_constant * self.rig.air.temperature / self.rig.air.supply_volume

    def drawn(self, s, supply):
        """What valves draw: chambers by mass and energy, flows by the other orifice."""
        air, v = self.rig.air, self.rig.valves
        pressures = (air.heat_capacity_ratio - 1) * s[8:12] / self.inner._volumes(s)
        temperatures = s[8:12] / s[4:8] * (air.heat_capacity_ratio - 1) / air.gas_constant
        total = 0.0
        for p, t, spool in zip(pressures, temperatures, s[14:18], strict=True):
            opened = v.sonic_conductance * (max(spool, 0.0) + v.leakage_ratio)
            how = (v.critical_ratio, air.reference_density, air.reference_temperature)
            forward = supply > p
            args = (opened, supply, air.temperature, p, *how) if forward else (opened, p, t, supply, *how)
            total += second_model.orifice(*args) * (1 if forward else -1)
        return total

    def advance(self, command, push, seconds):
        air, gas = self.rig.air, self.inner.constants[6].copy()
        scales = np.concatenate([SCALES, [1e-3], [0.1] * 4])

        def rates(_, scaled):
            x = scaled * scales
            s, mass, body = x[:18], x[18], x[19:]
            gas[0] = self.pressure(mass) if air.supply_conductance else air.supply_pressure
            force, falls = np.array(push), np.zeros(4)
            if self.handle:
                force = self.spring * (body[:2] - s[:2]) + self.damper * (body[2:] - s[2:4])
                weight = np.array([0.0, -self.handle * self.rig.mechanics.gravity])
                falls = np.concatenate([body[2:], (push + weight - force) / self.handle])
            filled = 0.0
            if air.supply_conductance:
                args = (air.supply_conductance, air.supply_pressure, air.temperature, gas[0], self.rig.valves.critical_ratio)
                filled = second_model.orifice(*args, air.reference_density, air.reference_temperature)
            ds = second_model.rates(s, command, force, *self.inner.constants[:6], gas)
            return np.concatenate([ds, [filled - self.drawn(s, gas[0])], falls]) / scales

        start = np.concatenate([self.inner.state, [self.reservoir], self.body]) / scales
        end = solve_ivp(rates, (0, seconds), start, method="DOP853", rtol=1e-9, atol=1e-12).y[:, -1] * scales
        self.inner.state, self.reservoir, self.body = end[:18], end[18], end[19:]

    @property
    def port(self):
        return self.body[:2] - self.sag if self.handle else self.inner.state[:2]


BOTH = pytest.param({**LINE, **HANDLE}, marks=pytest.mark.slow)


@pytest.mark.parametrize("changes", [LINE, HANDLE, BOTH], ids=["line", "handle", "both"])
def test_a_plant_with_reservoir_and_handle_moves_as_the_second_model_with_them(changes):
    rig = Parameters().replace(changes)
    plant, plain = Plant(rig), Plant()
    model = OtherOptions(rig, plant)
    lowest, apart = 7e5, 0.0
    for k in range(20):
        command, push = strong(k)
        model.advance(command, push, PERIOD)
        for one in (plant, plain):
            one.advance(command[:, None], push[:, None], PERIOD)
        # As the plant without options follows the second model in steps of 0.25 ms.
        np.testing.assert_allclose(plant.end_effector()[:2, 0], model.port, atol=2e-5)
        np.testing.assert_allclose(plant.pressures[:, 0], model.inner.pressures, rtol=2e-3)
        if changes is not HANDLE:
            supply = plant.lane_parameters[at.SUPPLY, 0]
            assert supply == pytest.approx(model.pressure(model.reservoir), rel=1e-4)
            assert plant.lane_parameters[at.INVERSE_SUPPLY, 0] == 1 / supply
            lowest = min(lowest, supply)
        apart = max(apart, np.abs(plant.end_effector() - plain.end_effector())[:2].max())
    assert apart > 5e-4, "it matters"
    if changes is not HANDLE:
        assert lowest < 6.5e5, "the supply droops"


def test_a_shut_plants_reservoir_fills_as_the_closed_form_says():
    """While the flow through the line is choked, it is C rho0 p, and the pressure grows on a straight line."""
    rig = Parameters().replace({**LINE, "air.supply_volume": 1e-3, "valves.leakage_ratio": 0.0})
    plant, air = Plant(rig), rig.air
    plant.memory[4 + options.RESERVOIR] = 1.2e5
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.1)
    flow = air.supply_conductance * air.reference_density * air.supply_pressure
    grown = 1.2e5 + 0.1 * flow * air.gas_constant * air.temperature / air.supply_volume
    assert grown < rig.valves.critical_ratio * air.supply_pressure
    assert plant.lane_parameters[at.SUPPLY, 0] == pytest.approx(grown, rel=1e-12)


def test_a_tubes_flow_and_the_air_in_the_chamber_follow_the_closed_form():
    """Behind an open, choked valve q = C rho0 Ps (1 - exp(-t/tau)), tau = L/c, and the chamber gains the integral."""
    rig = Parameters().replace({"chambers.tube_length": 2.0, "valves.leakage_ratio": 0.0})
    plant, air = Plant(rig), rig.air
    state = plant.state.copy()
    state[list(at.PRESSURES)], state[at.S1P] = 1.1e5, 1.0
    plant.state = state
    plant.memory[4 + options.FLOWS :] = 0.0
    tube = math.pi / 4 * rig.chambers.tube_diameter**2 * 2.0

    def mass():
        volume = rig.chambers.dead_volume + tube + rig.cylinder1.area_p * (rig.cylinder1.stroke / 2 + plant.state[at.Y1, 0])
        return plant.state[at.PP1, 0] * volume / (air.gas_constant * plant.state[at.TP1, 0])

    before, seconds = mass(), 0.012
    plant.advance(np.array([[1.0], [0.0], [0.0], [0.0]]), np.zeros((2, 1)), seconds)
    assert plant.state[at.PP1, 0] < rig.valves.critical_ratio * air.supply_pressure
    tau = 2.0 / math.sqrt(air.heat_capacity_ratio * air.gas_constant * air.temperature)
    full = rig.valves.sonic_conductance * air.reference_density * air.supply_pressure
    # A method of fourth order errs by (h/tau)^5/120 a step of exp(-h/tau), 1e-9, and there are 48 steps.
    error = (INTEGRATION_STEP / tau) ** (STAGES + 1) / math.factorial(STAGES + 1) * seconds / INTEGRATION_STEP
    assert plant.memory[4 + options.FLOWS, 0] == pytest.approx(full * (1 - math.exp(-seconds / tau)), rel=2 * error)
    gained = full * (seconds - tau * (1 - math.exp(-seconds / tau)))
    assert mass() - before == pytest.approx(gained, rel=1e-5)


def test_a_lane_without_options_among_others_has_the_bits_of_a_plain_plant():
    rigs = [Parameters(), *(Parameters().replace(changes) for changes in EACH.values())]
    plants = [Plant(rigs, len(rigs)), *(Plant(rig) for rig in rigs)]
    rng = np.random.default_rng(0)
    for _ in range(30):
        command, push = rng.uniform(-0.5, 0.5, (4, 1)), rng.uniform(-40, 40, (1, 2, 1))
        for plant in plants:
            plant.advance(np.repeat(command, plant.num_envs, 1), np.repeat(push, plant.num_envs, 2), 0.01)
    for lane, alone in enumerate(plants[1:]):
        np.testing.assert_array_equal(plants[0].state[:, lane], alone.state[:, 0])
        np.testing.assert_array_equal(plants[0].end_effector()[:, lane], alone.end_effector()[:, 0])


WORN = {"valves.supply_overlap": 0.05, "valves.exhaust_curvature": 0.3, "valves.opening_limit": 0.7}


@pytest.mark.parametrize("changes", [*EACH.values(), WORN], ids=[*EACH, "worn valves"])
def test_the_loop_moves_as_the_plant_alone(changes):
    rig = Parameters().replace({**changes, "valves.hysteresis": 0.02})
    env = gymnasium.make_vec(CIRCLE, num_envs=3, parameters=rig, user_force=lambda time: (5.0, 0.0), policy_period=0.001)
    env.reset(seed=0)
    plant, rng, simulation = Plant(rig, 3), np.random.default_rng(0), env.unwrapped.simulation
    plant.state = simulation.plant.state
    for _ in range(100):
        action = rng.uniform(-0.3, 0.3, (3, 4)).astype(np.float32)
        env.step(action)
        plant.advance(action.T.astype(float), np.tile([[5.0], [0.0]], 3), 0.001)
        np.testing.assert_allclose(simulation.plant.memory, plant.memory, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(simulation.plant.state, plant.state, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(simulation.motion, plant.end_effector(), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(simulation.plant.lane_parameters, plant.lane_parameters, rtol=1e-12)


def test_an_episode_begins_with_a_full_reservoir():
    rig = Parameters().replace(LINE)
    env = gymnasium.make_vec(CIRCLE, num_envs=2, parameters=rig)
    for _ in range(2):
        env.reset(seed=1)
        supply = env.unwrapped.simulation.plant.lane_parameters[at.SUPPLY]
        assert (supply == rig.air.supply_pressure).all()
        for _ in range(5):
            env.step(np.full((2, 4), 0.3, np.float32))
    assert (supply != rig.air.supply_pressure).all()


def test_every_range_can_be_drawn_and_none_is_unless_it_is_named():
    nominal = Parameters()
    assert checked_ranges(WORTH, nominal, "honest") == WORTH
    assert not set(WORTH) & set(documented_ranges(nominal, "honest"))
    assert "supply_overlap" not in nominal.to_dict()["valves"], "no stored rig changes"
    assert options.are_off(Plant().lane_parameters)
    assert Parameters.from_dict(nominal.replace(EACH["all"]).to_dict()) == nominal.replace(EACH["all"])
