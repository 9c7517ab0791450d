"""The pneumatic sections of a rig: what its chambers share, and air."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from birthsim_env.physics.rig.declaration import Prior, Section, derived, parameter

IN_CHAMBER = 0.75
"""Part of a tube's air that counts to the chamber's; the rest is at the valve's end (``physics.pneumatics.tubes``)."""


def _tube_volume(own: Any) -> Any:
    return np.pi / 4 * own.tube_diameter * own.tube_diameter * own.tube_length


@dataclass(frozen=True)
class Chambers(Section):
    """What all four chambers share: dead volume and heat exchange (the paper's section V)."""

    dead_volume: float = parameter(
        "m3",
        "dead volume V0 of a chamber, tubing included",
        default=10e-6,
        source="assumed",
        above=0,
        most=1000,
        range=(5e-6, 25e-6),
        identified=Prior(0.7),
        hardest_low=True,
        row=None,
    )
    wall_heat_transfer: float = parameter(
        "W/(m2 K)",
        "heat transfer h of the walls",
        default=50.0,
        source="assumed, cools in 0.2-1 s",
        least=0,
        most=1e4,
        range=(20, 100),
        identified=Prior(0.7),
        row="h_wall",
    )
    piston_conductance: float = parameter(
        "W/K",
        "G12, heat between the chambers of a cylinder",
        default=0.012,
        source="assumed",
        least=0,
        most=5,
        row="g12",
    )
    tube_length: float = parameter(
        "m",
        "length of the tube between valve and chamber, whose volume comes on top of the dead volume; 0 is none",
        default=0.0,
        source="0.5 to 3 assumed",
        least=0,
        most=10,
        option=True,
        range=(0.5, 3),
        on_request=True,
        identified=Prior(0.3, needs="tube_length"),
    )
    tube_diameter: float = parameter(
        "m",
        "diameter of the tube's bore",
        default=0.004,
        source="data sheets of tubes with 6 mm outside",
        least=1e-3,
        most=0.02,
        option=True,
        range=(0.0025, 0.006),
        on_request=True,
        identified=Prior(0.2, needs="tube_length"),
    )
    pressure_cells: str = parameter(
        "-",
        "where the pressure cells sit: in the chambers, or at the valves' ends of the tubes",
        default="chamber",
        source="assumed",
        choices=("chamber", "valve"),
        option=True,
    )

    whole_dead_volume = derived(
        "m3",
        "dead volume of a chamber, with its part of the tube",
        lambda own: own.dead_volume + IN_CHAMBER * _tube_volume(own),
        row="dead_volume",
    )
    cell_at_valve = derived(
        "1",
        "1 where pressure cells sit at the valves' ends of tubes, else 0",
        lambda own: np.where(np.greater(own.tube_length, 0.0), float(own.pressure_cells == "valve"), 0.0),
    )


@dataclass(frozen=True)
class Air(Section):
    """Supply, surroundings and the gas itself; absolute pressures."""

    supply_pressure: float = parameter(
        "Pa",
        "pressure of the supply",
        default=7.0e5,
        source="Table I quotes 6 bar gauge",
        above=0,
        most=15e5,
        hardest_low=True,
        row="supply",
    )
    atmospheric_pressure: float = parameter(
        "Pa", "pressure of the surroundings", default=1.013e5, source="standard", least=1e4, most=2e5, row="atmosphere"
    )
    temperature: float = parameter(
        "K", "temperature of supply, surroundings and walls", default=293.15, source="standard", least=230, most=370
    )
    gas_constant: float = parameter(
        "J/(kg K)", "r of dry air", default=287.05, source="standard", least=10, most=1e4, row="gas"
    )
    heat_capacity_ratio: float = parameter(
        "-", "ratio gamma of heat capacities", default=1.4, source="standard", least=1.01, most=2, row="gamma"
    )
    polytropic_index: float = parameter(
        "-", "polytropic index k of the control model (6)", default=1.2, source="assumed", least=1, most=2, row="index"
    )
    reference_density: float = parameter(
        "kg/m3", "reference density rho0", default=1.185, source="ISO 6358", least=0.01, most=100, row="rho0"
    )
    reference_temperature: float = parameter(
        "K", "reference temperature T0", default=293.15, source="ISO 6358", least=100, most=1000, row="t0"
    )
    supply_conductance: float = parameter(
        "m3/(s Pa)",
        "sonic conductance of the line to the reservoir; 0 is an ideal supply",
        default=0.0,
        source="assumed, one to five times that of a valve",
        least=0,
        most=1e-7,
        option=True,
        range=(4e-9, 2e-8),
        on_request=True,
        row="line",
    )
    supply_volume: float = parameter(
        "m3",
        "volume of the reservoir between the supply line and the valves",
        default=4e-4,
        source="data sheets of small reservoirs, 0.1 to 2 l",
        least=5e-5,
        most=10,
        option=True,
        range=(1e-4, 2e-3),
        on_request=True,
        row=None,
    )

    coldness = derived("1", "T0/T of supply and surroundings", lambda own: own.reference_temperature / own.temperature)
    inverse_supply = derived("1/Pa", "1/supply", lambda own: 1 / own.supply_pressure)
    inverse_atmosphere = derived("1/Pa", "1/atmosphere", lambda own: 1 / own.atmospheric_pressure)
    source = derived("Pa", "supply pressure to begin with and before the line", lambda own: own.supply_pressure)
    line_gain = derived("Pa/kg", "r T/V of the reservoir", lambda own: own.gas_constant * own.temperature / own.supply_volume)

    def _check_together(self) -> None:
        if self.supply_pressure <= self.atmospheric_pressure:
            raise ValueError(
                f"Air.supply_pressure = {self.supply_pressure!r} is impossible; "
                f"allowed: more than atmospheric_pressure = {self.atmospheric_pressure!r} (Pa)"
            )
