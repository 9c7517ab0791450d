"""A rig under a law, control period by control period, for the tests of the controllers: measurements and references."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest

from baselines.bench import probes
from birthsim_env.loop.signals import REFERENCES, Measurement, Reference
from birthsim_env.parts.sensors.lab import LabSensors
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.linkage.geometry import inverse_geometry, jacobian
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR


def slippery(scale: float, law: str = "lugre") -> Parameters:
    """The rig with ``scale`` times its Coulomb friction, of seals without pressure and of what pressure adds."""
    rig = Parameters()
    levels = {
        f"cylinder{k}.{part}_friction": scale * getattr(cylinder, f"{part}_friction")
        for k, cylinder in ((1, rig.cylinder1), (2, rig.cylinder2))
        for part in ("coulomb", "pressure")
    }
    return rig.replace({**levels, "friction.law": law})


FRICTIONLESS = slippery(0.0)
"""Neither Coulomb nor Stribeck friction; the viscous part stays."""

IDEAL = FRICTIONLESS.replace(LINEAR.changes())
"""``FRICTIONLESS`` with linear valves: a law whose crossing of an overlap takes time renders its setpoints less exactly."""

AT_ONCE = {"valves.crossing": 1e-4}
"""Overlaps that a law crosses at a ten thousandth of full flow: what flows is what it wants at nearly all times."""


PNEUMATIC_STIFFNESS = np.array([[4400.0], [2200.0]])
"""N/m, of both cylinders: inside the range of (9) at all poses that the tests use."""


def shorten_probes(
    patch: pytest.MonkeyPatch, rest: float = 1.0, rise: float = 0.5, hold: float = 2.0, window: float = 0.5
) -> None:
    """Stiffness tests with other times than those of the comparison, s, for as long as ``patch`` lasts."""
    for name, seconds in (("REST", rest), ("RISE", rise), ("HOLD", hold), ("WINDOW", window)):
        patch.setattr(probes, name, seconds)


def pushes(
    forces: Sequence[float],
    setpoints: Sequence[float] = (1000.0, 2000.0, 4000.0),
    rigs: Sequence[Parameters] = (Parameters(),),
    poses: Sequence[tuple[float, float]] = probes.POSES,
) -> probes.StiffnessTest:
    """Every force, N, along both axes at every pose and setpoint, N/m, on every rig: a lane each."""
    place, stiffness, axis, force, own = zip(*itertools.product(poses, setpoints, (0, 1), forces, rigs), strict=True)
    push = np.array(force) * (np.array(axis) == np.array([[0], [1]]))
    rows = np.array([stiffness, stiffness, np.zeros(len(force))])
    return probes.StiffnessTest(np.array(place).T.copy(), push, rows, own if len(rigs) > 1 else rigs[0])


def ideal(plant: Plant, time: float, force: Array) -> Measurement:
    """What exact sensors say of the plant."""
    motion, clock = plant.end_effector(), np.full(plant.num_envs, time)
    return Measurement(clock, motion[:2], clock, motion[2:], plant.pressures, force, sampled=False)


def tracker(rig: Parameters, lanes: int, seed: int = 0) -> Callable[[Plant, float, Array], Measurement]:
    """The sensor model ``lab``, every lane with a seed of its own."""
    sensors = LabSensors(rig.electronics, lanes)
    for lane in range(lanes):
        sensors.begin(lane, np.random.default_rng([seed, lane]))

    def sense(plant: Plant, time: float, force: Array) -> Measurement:
        ticks = np.full(lanes, round(1000 * time))
        return sensors.measure(ticks, np.full(lanes, time), plant.end_effector(), plant.pressures, force)

    return sense


def of_lanes(measured: Measurement, lanes: Any) -> Measurement:
    """The signals of some lanes, or of one rig without a lane axis where ``lanes`` is a number."""
    fields = {name: value for name, value in vars(measured).items() if isinstance(value, np.ndarray)}
    some = {name: np.array(value[..., lanes], order="C") for name, value in fields.items()}
    return Measurement(**some, sampled=measured.sampled)


def holding(position: Array, stiffness: Array | float) -> Reference:
    """A resting target at ``position`` (2, N) with closed-loop stiffness ``stiffness`` on both axes, or (2, N)."""
    rows = np.zeros((REFERENCES, position.shape[1]))
    rows[0:2], rows[8:10], rows[10:12] = position, stiffness, PNEUMATIC_STIFFNESS
    return Reference(rows)


def circling(time: float, radius: float, period: float, stiffness: Array | float, lanes: int = 1) -> Reference:
    """A target on a circle about (0.5, 0), the same in all lanes."""
    rate = 2 * np.pi / period
    position = radius * np.array([[np.cos(rate * time)], [np.sin(rate * time)]])
    velocity = rate * np.array([-position[1], position[0]])
    rows = np.zeros((REFERENCES, lanes))
    rows[0:2] = position + np.array([[0.5], [0.0]])
    rows[2:4], rows[4:6], rows[6:8] = velocity, -(rate**2) * position, -(rate**2) * velocity
    rows[8:10], rows[10:12] = stiffness, PNEUMATIC_STIFFNESS
    return Reference(rows)


def resting_at(reference: Reference, parameters: Parameters) -> Plant:
    """A plant on the target, with the target's velocity and pneumatic stiffness, in balance."""
    plant = Plant(parameters, reference.rows.shape[1])
    piston = inverse_geometry(reference.position, parameters)
    speed = np.stack(
        [np.linalg.solve(jacobian(y, parameters), v) for y, v in zip(piston.T, reference.velocity.T, strict=True)], axis=1
    )
    plant.state = balanced_state(plant.lane_parameters, piston, speed, reference.pneumatic_stiffness)
    return plant


def run(
    plant: Plant,
    law: Callable[[Measurement, Reference], Array],
    reference: Callable[[float], Reference],
    force: Callable[[float], Array],
    seconds: float,
    sense: Callable[[Plant, float, Array], Measurement] = ideal,
) -> Iterator[tuple[float, Reference, Array, Array]]:
    """Closes the loop at 1 kHz; yields time, reference, user force (2, N) and openings (4, N) before each period."""
    for tick in range(round(seconds * 1000)):
        time = tick * 1e-3
        wanted, push = reference(time), np.ascontiguousarray(force(time))
        openings = law(sense(plant, time, push), wanted)
        yield time, wanted, push, openings
        plant.advance(openings, push, 1e-3)
