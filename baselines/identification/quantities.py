"""What is identified: parameters of a rig, how they are scaled, and how far from the owner's value they may lie."""

import math
from dataclasses import dataclass

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, field_of, least_dead_volume


@dataclass(frozen=True)
class Quantity:
    """A parameter ``name`` and its coordinate: log(value - ``floor``), or value over ``unit`` s where ``unit`` is not zero.

    ``spread`` is the standard deviation of the coordinate before anything is measured, about the owner's value; assumed.
    """

    name: str
    spread: float
    floor: float = 0.0
    unit: float = 0.0

    def coordinate(self, value: float) -> float:
        """The coordinate of a value."""
        return value / self.unit if self.unit else math.log(max(value - self.floor, 1e-12))

    def value(self, coordinate: float) -> float:
        """The value at a coordinate."""
        return coordinate * self.unit if self.unit else self.floor + math.exp(coordinate)


LATENCY = "electronics.position_latency"

QUANTITIES = (
    Quantity("cylinder1.coulomb_friction", 0.7),
    Quantity("cylinder1.viscous_friction", 0.7),
    Quantity("cylinder2.coulomb_friction", 0.7),
    Quantity("cylinder2.viscous_friction", 0.7),
    Quantity("friction.static_ratio", 0.7, floor=1.0),
    Quantity("friction.stribeck_speed", 0.7),
    Quantity("friction.bristle_stiffness", 0.7),
    Quantity("friction.bristle_damping", 0.7),
    Quantity("mechanics.mass", 0.5),
    Quantity("valves.sonic_conductance", 0.5),
    Quantity("valves.critical_ratio", 0.3),
    Quantity("valves.leakage_ratio", 0.7),
    Quantity("valves.time_constant", 0.7),
    Quantity("chambers.dead_volume", 0.7),
    Quantity("chambers.wall_heat_transfer", 0.7),
    Quantity(LATENCY, 1.0, unit=0.005),
)
"""What is identified."""


FURTHEST = 3.5
"""Spreads from the owner's value within which a parameter is looked for."""

INSIDE = 1e-3
"""Coordinates by which the search stays within what the rig's description allows, more than a step of differences."""


def unmeasured(rig: Parameters) -> Parameters:
    """``rig`` as it is known before its log: what is identified has the default rig's values."""
    known = {one.name: value_of(Parameters(), one.name) for one in QUANTITIES}
    known["chambers.dead_volume"] = max(known["chambers.dead_volume"], least_dead_volume(rig))
    return rig.replace(known)


def limits(rig: Parameters, quantities: tuple[Quantity, ...]) -> tuple[Array, Array]:
    """The least and the largest coordinates (Q,) that are looked at, for the rig as its owner describes it."""
    low, high = [], []
    for one, centre in zip(quantities, coordinates(rig, quantities), strict=True):
        about = field_of(one.name).metadata
        least = max(about["least"], about["above"], least_dead_volume(rig) if one.name == "chambers.dead_volume" else -math.inf)
        low.append(max(one.coordinate(least) + INSIDE, centre - FURTHEST * one.spread))
        high.append(min(one.coordinate(about["most"]) - INSIDE, centre + FURTHEST * one.spread))
    return np.array(low), np.array(high)


def coordinates(rig: Parameters, quantities: tuple[Quantity, ...]) -> Array:
    """The coordinates (Q,) of a rig."""
    return np.array([one.coordinate(value_of(rig, one.name)) for one in quantities])


def rig_at(rig: Parameters, quantities: tuple[Quantity, ...], theta: Array) -> Parameters:
    """``rig`` with the values at coordinates (Q,)."""
    return rig.replace({one.name: one.value(float(c)) for one, c in zip(quantities, theta, strict=True)})


def value_of(rig: Parameters, name: str) -> float:
    """The value of a dotted name."""
    section, _, field = name.partition(".")
    return float(getattr(getattr(rig, section), field))
