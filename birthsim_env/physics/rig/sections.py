"""The sections of a rig, from its linkage to its air, with unit and basis of every figure."""

import math
from dataclasses import dataclass

from birthsim_env.physics.rig.quantities import Part, quantity


@dataclass(frozen=True)
class Geometry(Part):
    """Planar linkage of the paper's Fig. 1 and Table II; frame 0 at the pivot of cylinder 2, x forward, y up."""

    d3: float = quantity(0.35, "m", "assumed", least=1e-3, most=10)
    d6: float = quantity(0.25, "m", "assumed", least=1e-3, most=10)
    gamma3: float = quantity(math.pi / 2, "rad", "assumed", least=-math.pi, most=math.pi)
    k1: float = quantity(0.430, "m", "assumed; r4 = y1 + k1 (2)", least=1e-3, most=10)
    k2: float = quantity(0.500, "m", "assumed; r2 = y2 + k2 (2)", least=1e-3, most=10)


@dataclass(frozen=True)
class Cylinder(Part):
    """One double-acting, single-rod pneumatic cylinder."""

    piston_diameter: float = quantity(0.025, "m", "Table I", least=1e-3, most=1)
    rod_diameter: float = quantity(0.010, "m", "Table I, from its 295 and 247 N", least=0)
    stroke: float = quantity(0.200, "m", "Table I", least=1e-3, most=10)
    coulomb_friction: float = quantity(12.0, "N", "assumed, 4-5 % of the rated force", least=0, most=1e5, randomized=(6, 25))
    viscous_friction: float = quantity(35.0, "N s/m", "assumed", least=0, most=1e5, randomized=(10, 60))

    def _check_together(self) -> None:
        if self.rod_diameter >= self.piston_diameter:
            raise ValueError(
                f"Cylinder.rod_diameter = {self.rod_diameter!r} is impossible; "
                f"allowed: less than piston_diameter = {self.piston_diameter!r} (m)"
            )

    @property
    def area_p(self) -> float:
        """Piston area of chamber P, the full bore, m2."""
        return math.pi / 4 * self.piston_diameter * self.piston_diameter

    @property
    def area_n(self) -> float:
        """Piston area of chamber N, the bore less the rod, m2."""
        return math.pi / 4 * (self.piston_diameter * self.piston_diameter - self.rod_diameter * self.rod_diameter)


@dataclass(frozen=True)
class Mechanics(Part):
    """The point mass at the end effector and the end stops of the cylinders."""

    mass: float = quantity(3.0, "kg", "assumed", above=0, most=1e20, randomized=(2, 5))
    gravity: float = quantity(9.81, "m/s2", "standard", least=0, most=100)
    stop_stiffness: float = quantity(5e6, "N/m", "assumed, rigid end caps", above=0, most=1e7)
    stop_damping: float = quantity(1.0, "s/m", "assumed; force k p (1 + c dp/dt), Hunt and Crossley 1975", least=0, most=2)
    impact_speed: float = quantity(0.1, "m/s", "assumed; a faster collision with an end stop is reported", above=0, most=100)
    mode_frequency: float = quantity(
        0.0,
        "Hz",
        "0 is rigid; natural frequency of the handle with the linkage held, 19 to 60 assumed",
        least=0,
        most=200,
        option=True,
        worth=(19, 60),
    )
    mode_damping: float = quantity(
        0.03, "-", "assumed; damping ratio of the handle on the structure", least=0, most=1, option=True, worth=(0.01, 0.1)
    )
    mode_mass_fraction: float = quantity(
        0.2, "-", "assumed; share of the mass that is the handle's", least=0.02, most=0.8, option=True, worth=(0.1, 0.4)
    )


@dataclass(frozen=True)
class Friction(Part):
    """Friction law of both pistons; the Coulomb and viscous levels belong to each cylinder."""

    law: str = quantity(
        "lugre",
        "-",
        "LuGre (Canudas de Wit 1995), the paper's (4), or elasto-plastic without presliding drift (Dupont 2002)",
        choices=("lugre", "coulomb", "elasto_plastic"),
    )
    static_ratio: float = quantity(1.33, "-", "assumed; Fs/Fc", least=1, most=10)
    stribeck_speed: float = quantity(0.015, "m/s", "assumed", least=1e-6, most=10)
    bristle_stiffness: float = quantity(5e4, "N/m", "assumed; s0", least=1, most=5e5)
    bristle_damping: float = quantity(150.0, "N s/m", "assumed; s1", least=0, most=2000)
    breakaway_ratio: float = quantity(
        0.7,
        "-",
        "assumed; z_ba/z_ss, elasto-plastic law only: below this fraction of the level it is a spring",
        above=0,
        most=0.9,
    )
    sign_speed: float = quantity(0.002, "m/s", "numerical; (4)'s sign(v) is v/sign_speed below it", least=0.001, most=10)


@dataclass(frozen=True)
class Chambers(Part):
    """What all four chambers share: dead volume and heat exchange (the paper's section V)."""

    dead_volume: float = quantity(10e-6, "m3", "assumed, tubing included; V0", above=0, most=1000, randomized=(5e-6, 25e-6))
    wall_heat_transfer: float = quantity(
        50.0, "W/(m2 K)", "assumed; h, cools in 0.2-1 s", least=0, most=1e4, randomized=(20, 100)
    )
    piston_conductance: float = quantity(0.012, "W/K", "assumed; G12, heat between the chambers of a cylinder", least=0, most=5)
    tube_length: float = quantity(
        0.0,
        "m",
        "0 is none; between valve and chamber, its volume comes on top of the dead volume, 0.5 to 3 assumed",
        least=0,
        most=10,
        option=True,
        worth=(0.5, 3),
    )
    tube_diameter: float = quantity(
        0.004,
        "m",
        "of the tube's bore, data sheets of tubes with 6 mm outside",
        least=1e-3,
        most=0.02,
        option=True,
        worth=(0.0025, 0.006),
    )


@dataclass(frozen=True)
class Valves(Part):
    """Proportional servovalve: ISO 6358 orifices behind a spool with a first-order lag."""

    sonic_conductance: float = quantity(3.9e-9, "m3/(s Pa)", "from 100 l/min nominal, 6 to 5 bar; C", least=1e-12, most=2e-8)
    critical_ratio: float = quantity(0.30, "-", "from 100 l/min nominal, 6 to 5 bar; b", least=0, most=0.9)
    leakage_ratio: float = quantity(0.005, "-", "assumed; Cl/C", least=0, most=0.5)
    time_constant: float = quantity(0.004, "s", "assumed; -3 dB at 40 Hz", least=2e-4, most=10, randomized=(0.0015, 0.008))
    deadband: float = quantity(
        0.0,
        "-",
        "off; opening within which nothing opens, up to 0.05 assumed of overlapped spools",
        least=0,
        most=0.5,
        option=True,
        worth=(0, 0.05),
    )
    hysteresis: float = quantity(
        0.0, "-", "off; width of the play in the opening, up to 0.02 assumed", least=0, most=0.5, option=True, worth=(0, 0.02)
    )
    opening_limit: float = quantity(
        1.0, "-", "off; largest opening, 0.8 to 1 assumed", above=0, most=1, option=True, worth=(0.8, 1)
    )


@dataclass(frozen=True)
class Air(Part):
    """Supply, surroundings and the gas itself; absolute pressures."""

    supply_pressure: float = quantity(7.0e5, "Pa", "Table I quotes 6 bar gauge", above=0, most=15e5)
    atmospheric_pressure: float = quantity(1.013e5, "Pa", "standard", least=1e4, most=2e5)
    temperature: float = quantity(293.15, "K", "standard; supply, surroundings and walls", least=230, most=370)
    gas_constant: float = quantity(287.05, "J/(kg K)", "standard; r of dry air", least=10, most=1e4)
    heat_capacity_ratio: float = quantity(1.4, "-", "standard; gamma", least=1.01, most=2)
    polytropic_index: float = quantity(1.2, "-", "assumed; k of the control model (6)", least=1, most=2)
    reference_density: float = quantity(1.185, "kg/m3", "ISO 6358; rho0", least=0.01, most=100)
    reference_temperature: float = quantity(293.15, "K", "ISO 6358; T0", least=100, most=1000)
    supply_conductance: float = quantity(
        0.0,
        "m3/(s Pa)",
        "0 is an ideal supply; sonic conductance of the line to the reservoir, assumed, one to five times that of a valve",
        least=0,
        most=1e-7,
        option=True,
        worth=(4e-9, 2e-8),
    )
    supply_volume: float = quantity(
        4e-4,
        "m3",
        "data sheets of small reservoirs, 0.1 to 2 l; between the supply line and the valves",
        least=5e-5,
        most=10,
        option=True,
        worth=(1e-4, 2e-3),
    )

    def _check_together(self) -> None:
        if self.supply_pressure <= self.atmospheric_pressure:
            raise ValueError(
                f"Air.supply_pressure = {self.supply_pressure!r} is impossible; "
                f"allowed: more than atmospheric_pressure = {self.atmospheric_pressure!r} (Pa)"
            )
