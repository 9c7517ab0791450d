"""Options of the plant: against the second model with a reservoir and a second body, closed forms, the plain plant."""

import math

import gymnasium
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from birthsim_env.parts.drawn.randomization import checked_ranges, documented_ranges
from birthsim_env.physics import options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.pneumatics import tubes
from birthsim_env.physics.rig.parameters import DECLARED, Parameters
from lab.studies.accuracy import second_model
from lab.studies.accuracy.motions import PERIOD, strong
from lab.studies.accuracy.second_model import SCALES, SecondModel

CIRCLE = "BirthSIM/Circle-v2"
LINE = {"air.supply_conductance": 4e-9, "air.supply_volume": 1e-4}
TUBE = {"chambers.tube_length": 1.0}
HANDLE = {"mechanics.mode_frequency": 25.0, "mechanics.mode_damping": 0.05, "mechanics.mode_mass_fraction": 0.3}
EACH = {"line": LINE, "tube": TUBE, "handle": HANDLE, "all": {**LINE, **TUBE, **HANDLE}}
WORTH = {name: one.range for name, one in DECLARED.items() if one.on_request}


def other_tube_rate(rig, end, chamber, flow, temperature):
    """d(flow)/dt in a tube, from the equation of the momentum of its air and Gidlund's figures."""
    air, length, bore = rig.air, rig.chambers.tube_length, rig.chambers.tube_diameter
    sonic = 0.029 * bore**2 / math.sqrt(length / bore**1.25 + 510)
    critical = 474 * sonic / bore**2
    (upper, hot), (lower, _) = sorted([(end, air.temperature), (chamber, temperature)], reverse=True)
    below = max(lower / upper - critical, 0) / (1 - critical)
    push = min(upper - lower, (1 - critical) * upper) * (1 if end > chamber else -1)
    steady = (sonic * air.reference_density) ** 2 * air.reference_temperature / hot * upper * (1 + below) / (1 - critical)
    laminar = 32 * 1.81e-5 * air.gas_constant * air.temperature / bore**2 * flow / upper
    return math.pi / 4 * bore**2 / length * (push - flow * abs(flow) / steady) - laminar


class OtherOptions:
    """The second model with a reservoir, kept by its mass of air, a handle, a body with weight of its own on a spring, and
    tubes, each the air at its valve's end and a flow."""

    def __init__(self, rig, plant):
        self.rig, m = rig, rig.mechanics
        self.handle = m.mass * m.mode_mass_fraction if m.mode_frequency else 0.0
        self.spring = self.handle * (2 * math.pi * m.mode_frequency) ** 2
        self.damper = 2 * m.mode_damping * math.sqrt(self.spring * self.handle)
        self.sag = np.array([0.0, -self.handle * m.gravity / self.spring]) if self.handle else np.zeros(2)
        air, tube = rig.air, rig.chambers.tube_length * math.pi / 4 * rig.chambers.tube_diameter**2
        of_chamber = {"chambers.dead_volume": rig.chambers.dead_volume + 0.75 * tube}
        changes = {"mechanics.mass": m.mass - self.handle, **(of_chamber if tube else {})}
        self.inner = SecondModel(rig.replace(changes), plant.end_effector()[:, 0], plant.state[:, 0])
        self.tube = 0.25 * tube
        if tube:
            self.inner.constants[4][[0, 2]] = 0.0  # the valves stand at the tubes' other ends
        self.ends = np.concatenate([plant.pressures[:, 0] * self.tube / (air.gas_constant * air.temperature), np.zeros(4)])
        self.reservoir = air.supply_pressure * air.supply_volume / (air.gas_constant * air.temperature)
        self.body = np.concatenate([plant.end_effector()[:2, 0] + self.sag, plant.end_effector()[2:, 0]])

    def pressure(self, mass):
        return mass * self.rig.air.gas_constant * self.rig.air.temperature / self.rig.air.supply_volume

    def chambers(self, s):
        """Pressures and temperatures of the chambers, from mass and energy."""
        air = self.rig.air
        temperatures = s[8:12] / s[4:8] * (air.heat_capacity_ratio - 1) / air.gas_constant
        return (air.heat_capacity_ratio - 1) * s[8:12] / self.inner._volumes(s), temperatures

    def passed(self, s, source, ends, sign):
        """What valves let through between a ``source`` and the chambers or tubes' ends, by the other orifice."""
        air, v = self.rig.air, self.rig.valves
        pressures, temperatures = self.chambers(s)
        if self.tube:
            pressures, temperatures = self.at_ends(ends), np.full(4, air.temperature)
        total = []
        edges = self.inner.constants[5][:, 0 if sign > 0 else 1]
        for p, t, spool, edge in zip(pressures, temperatures, s[14:18], edges, strict=True):
            opened = v.sonic_conductance * (second_model.opened(sign * spool, edge) + v.leakage_ratio)
            how = (v.critical_ratio, air.reference_density, air.reference_temperature)
            forward = source > p
            args = (opened, source, air.temperature, p, *how) if forward else (opened, p, t, source, *how)
            total.append(second_model.orifice(*args) * (1 if forward else -1))
        return np.array(total)

    def at_ends(self, ends):
        air = self.rig.air
        return ends[:4] * air.gas_constant * air.temperature / self.tube

    def through_tubes(self, ds, s, supply, ends):
        """Adds what the tubes bring to the chambers' masses and energies; returns the rates of ``ends``."""
        air, flow = self.rig.air, ends[4:]
        heat_capacity = air.heat_capacity_ratio * air.gas_constant / (air.heat_capacity_ratio - 1)
        pressures, temperatures = self.chambers(s)
        ds[4:8] += flow
        ds[8:12] += flow * heat_capacity * np.where(flow > 0, air.temperature, temperatures)
        both = self.passed(s, supply, ends, 1) + self.passed(s, air.atmospheric_pressure, ends, -1)
        rates = map(other_tube_rate, [self.rig] * 4, self.at_ends(ends), pressures, flow, temperatures)
        return np.concatenate([both - flow, list(rates)])

    def advance(self, command, push, seconds):
        air, gas = self.rig.air, self.inner.constants[6].copy()
        scales = np.concatenate([SCALES, [1e-3], [0.1] * 4, [1e-5] * 4, [1e-3] * 4])

        def rates(_, scaled):
            x = scaled * scales
            s, mass, body, ends = x[:18], x[18], x[19:23], x[23:]
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
            moved = self.through_tubes(ds, s, gas[0], ends) if self.tube else np.zeros(8)
            return np.concatenate([ds, [filled - self.passed(s, gas[0], ends, 1).sum()], falls, moved]) / scales

        start = np.concatenate([self.inner.state, [self.reservoir], self.body, self.ends]) / scales
        end = solve_ivp(rates, (0, seconds), start, method="DOP853", rtol=1e-9, atol=1e-12).y[:, -1] * scales
        self.inner.state, self.reservoir, self.body, self.ends = end[:18], end[18], end[19:23], end[23:]

    @property
    def port(self):
        return self.body[:2] - self.sag if self.handle else self.inner.state[:2]


ALL = pytest.param(EACH["all"], marks=pytest.mark.slow)


@pytest.mark.parametrize("changes", [LINE, TUBE, HANDLE, ALL], ids=EACH)
def test_a_plant_with_reservoir_tubes_and_handle_moves_as_the_second_model_with_them(changes):
    rig = Parameters().replace(changes)
    plant, plain = Plant(rig), Plant()
    model = OtherOptions(rig, plant)
    lowest, apart = 7e5, 0.0
    for k in range(20):
        command, push = strong(k)
        model.advance(command, push, PERIOD)
        for one in (plant, plain):
            one.advance(command[:, None], push[:, None], PERIOD)
        # About twice what was measured, where the plant without options is as far from the second model.
        np.testing.assert_allclose(plant.end_effector()[:2, 0], model.port, atol=2.6e-6)
        np.testing.assert_allclose(plant.pressures[:, 0], model.inner.pressures, rtol=1.7e-5)
        if "chambers.tube_length" in changes:
            np.testing.assert_allclose(
                plant.memory[4 + options.TUBES : 4 + options.FLOWS, 0], model.at_ends(model.ends), rtol=2.1e-4
            )
            np.testing.assert_allclose(plant.memory[4 + options.FLOWS : 4 + options.BRISTLES, 0], model.ends[4:], atol=3e-6)
        if "air.supply_conductance" in changes:
            supply = plant.lane_parameters[at.SUPPLY, 0]
            assert supply == pytest.approx(model.pressure(model.reservoir), rel=1.7e-6)
            assert plant.lane_parameters[at.INVERSE_SUPPLY, 0] == 1 / supply
            lowest = min(lowest, supply)
        apart = max(apart, np.abs(plant.end_effector() - plain.end_effector())[:2].max())
    assert apart > 5e-4, "it matters"
    if "air.supply_conductance" in changes:
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


def held(length, bore, **changes):
    """A plant with tubes whose pistons are nailed down, almost, and whose chamber P1 is filled or vented."""
    rig = {"chambers.tube_length": length, "chambers.tube_diameter": bore, "mechanics.mass": 1e6, "mechanics.gravity": 0.0}
    return Plant(Parameters().replace({**rig, **changes}))


def air_in(plant, rig):
    """Mass and energy of the air of chamber P1 with its tube, kg and J."""
    gas, gamma = rig.air.gas_constant, rig.air.heat_capacity_ratio
    tube = math.pi / 4 * rig.chambers.tube_diameter**2 * rig.chambers.tube_length
    chamber = rig.chambers.dead_volume + 0.75 * tube + rig.cylinder1.area_p * (rig.cylinder1.stroke / 2 + plant.state[at.Y1, 0])
    end, pressure, temperature = plant.memory[4 + options.TUBES, 0], plant.state[at.PP1, 0], plant.state[at.TP1, 0]
    mass = pressure * chamber / (gas * temperature) + end * 0.25 * tube / (gas * rig.air.temperature)
    return mass, (pressure * chamber + end * 0.25 * tube) / (gamma - 1)


@pytest.mark.parametrize(("length", "bore"), [(0.5, 0.004), (2.0, 0.004), (3.0, 0.0025), (1.0, 0.006)])
def test_a_steady_flow_through_a_tube_is_that_of_iso_6358_but_for_laminar_friction(length, bore):
    sonic = float(tubes.conductance(length, bore))
    critical = float(tubes.critical_ratio(sonic, bore))
    constants = np.empty((tubes.CONSTANTS, 1))
    rig = Parameters().replace({"chambers.tube_length": length, "chambers.tube_diameter": bore})
    tubes.fill_constants(at.parameter_array(rig, 1), constants, 1)
    how = constants[[tubes.INERTANCE, tubes.VISCOUS, tubes.RESISTANCE, tubes.CRITICAL], 0]
    for pressure, beyond in ((7e5, 6.5e5), (7e5, 4e5), (7e5, 1.2e5), (3e5, 6e5)):
        flow = second_model.orifice(sonic, max(pressure, beyond), 293.15, min(pressure, beyond), critical, 1.185, 293.15)
        flow = math.copysign(flow, pressure - beyond)
        rate = tubes.flow_rate(pressure, beyond, flow, 1.0, how[0], 0.0, how[2], how[3])
        assert abs(rate) < 1e-9 * how[0] * abs(pressure - beyond)
        laminar = (
            32 * tubes.VISCOSITY * length * flow / (math.pi / 4 * bore**2 * bore**2 * max(pressure, beyond) / (287.05 * 293.15))
        )
        slowed = tubes.flow_rate(pressure, beyond, flow, 1.0, *how)
        assert slowed == pytest.approx(-how[0] * laminar, rel=1e-6)


@pytest.mark.parametrize("way", [1.0, -1.0], ids=["filled", "vented"])
def test_the_air_behind_a_tube_is_what_its_valve_let_through(way):
    """The books of mass and energy of a chamber and its tube, all insulated but the tube, which keeps its temperature."""
    off = {"chambers.wall_heat_transfer": 0.0, "chambers.piston_conductance": 0.0, "valves.leakage_ratio": 0.0}
    plant = held(2.0, 0.004, **off)
    rig = Parameters().replace({"chambers.tube_length": 2.0, **off})
    state = plant.state.copy()
    state[list(at.PRESSURES)] = 1.5e5 if way > 0 else 6.5e5
    plant.state = state
    heat_capacity = 3.5 * rig.air.gas_constant * rig.air.temperature
    (mass, energy), step, passed, warmed = air_in(plant, rig), 1e-5, 0.0, 0.0
    gain = rig.air.gas_constant * rig.air.temperature / (rig.air.heat_capacity_ratio - 1)
    opening = np.array([[way], [0.0], [0.0], [0.0]])
    for _ in range(6000):
        flows, flow = plant.mass_flows()[[0, 4], 0], plant.memory[4 + options.FLOWS, 0]
        plant.advance(opening, np.zeros((2, 1)), step)
        flows, through = 0.5 * (flows + plant.mass_flows()[[0, 4], 0]), 0.5 * (flow + plant.memory[4 + options.FLOWS, 0])
        passed += step * (flows[0] - flows[1])
        # Into the chamber at the walls' temperature, out of it at its own; the tube's end has the energy of its mass.
        carried = heat_capacity * (through if through > 0 else through * plant.state[at.TP1, 0] / rig.air.temperature)
        warmed += step * (carried + gain * (flows[0] - flows[1] - through))
    after, stored = air_in(plant, rig)
    assert abs(passed) > 1e-4
    assert after - mass == pytest.approx(passed, rel=1e-5)
    assert stored - energy == pytest.approx(warmed, rel=1e-4)


def test_a_chamber_behind_a_long_tube_feels_an_opened_valve_late():
    """Of 5 m, which sound passes in 15 ms: next to nothing arrives in the first quarter of that, and most in twice that."""
    plant = held(5.0, 0.004)
    state = plant.state.copy()
    state[list(at.PRESSURES)], state[at.S1P] = 2e5, 1.0
    plant.state = state
    flows = []
    for _ in range(60):
        plant.advance(np.array([[1.0], [0.0], [0.0], [0.0]]), np.zeros((2, 1)), 0.001)
        flows.append(plant.memory[4 + options.FLOWS, 0])
    arrived = np.array(flows) / max(flows)
    assert arrived[3] < 0.15
    assert arrived[29] > 0.85


SIZES = {
    **{(0.02, 0.004): 800.0, (0.5, 0.001): 17.0, (0.5, 0.0025): 50.0, (1.0, 0.004): 53.0},
    **{(3.0, 0.006): 37.0, (0.2, 0.02): 1750.0, (10.0, 0.02): 1.5, (0.05, 0.001): 40.0},
}
"""Length and bore of tubes, m, and Pa, about twice what was measured; linear valves halve what is the most of them."""


@pytest.mark.parametrize(("length", "bore"), SIZES)
def test_the_step_follows_tubes_of_every_size(length, bore):
    """A policy step at the longest step is near that in steps of 1/16 ms, through openings, closings and equal pressures; a
    spool that is thrown open leaves its overlap amid a step."""
    coarse, fine = held(length, bore), held(length, bore)
    rng, apart, span = np.random.default_rng(2), 0.0, 0.0
    for _ in range(40):
        command = rng.choice([-1.0, 0.0, 1.0], (4, 1))
        coarse.advance(command, np.zeros((2, 1)), 0.005)
        for _ in range(80):
            fine.advance(command, np.zeros((2, 1)), 1e-3 / 16)
        ends = slice(4 + options.TUBES, 4 + options.FLOWS)
        apart = max(apart, np.abs(coarse.pressures - fine.pressures).max())
        assert np.abs(coarse.memory[ends] - fine.memory[ends]).max() < 8e3
        span = max(span, np.ptp(coarse.pressures))
    assert span > 5e4
    assert apart < SIZES[length, bore]


def test_a_cell_at_the_valve_shows_the_pressure_there():
    rigs = [Parameters().replace({**TUBE, "chambers.pressure_cells": where}) for where in ("chamber", "valve")]
    shown = []
    for rig in rigs:
        env = gymnasium.make(CIRCLE, parameters=rig, policy_period=0.001).unwrapped
        env.reset(seed=0)
        for k in range(30):
            env.step(np.full(4, -1.0 if k > 10 else 0.0, np.float32))
        plant = env.simulation.plant
        shown.append((env.measurement.pressures, plant.pressures[:, 0], plant.memory[4 + options.TUBES : 4 + options.FLOWS, 0]))
    (inner, true, end), (outer, same, other) = shown
    np.testing.assert_array_equal(true, same)
    np.testing.assert_array_equal(inner, true)
    np.testing.assert_array_equal(outer, other)
    np.testing.assert_array_equal(end, other)
    assert (true - outer).max() > 1e4, "while it vents"


@pytest.mark.parametrize("sensors", ["ideal", "honest"])
def test_a_cell_without_a_tube_is_in_the_chamber(sensors):
    rows = []
    for where in ("chamber", "valve"):
        env = gymnasium.make(CIRCLE, parameters={"chambers.pressure_cells": where}, sensors=sensors).unwrapped
        env.reset(seed=0)
        env.step(np.full(4, 0.3, np.float32))
        rows.append(env.measurement.pressures)
    np.testing.assert_array_equal(*rows)


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
    assert not WORTH.keys() & {f"{section}.{name}" for section, own in nominal.to_dict().items() for name in own}
    assert options.are_off(Plant().lane_parameters)
    assert Parameters.from_dict(nominal.replace(EACH["all"]).to_dict()) == nominal.replace(EACH["all"])
