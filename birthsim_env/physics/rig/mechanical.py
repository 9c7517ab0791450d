"""The mechanical sections of a rig: linkage, cylinders, mass and end stops, friction."""

import math
from dataclasses import dataclass

import numpy as np

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.rig.declaration import Prior, Section, derived, parameter


@dataclass(frozen=True)
class Geometry(Section, shared=True):
    """Planar linkage of the paper's Fig. 1 and Table II; frame 0 at the pivot of cylinder 2, x forward, y up."""

    d3: float = parameter(
        "m", "distance of the pivots of both cylinders", default=0.35, source="assumed", least=1e-3, most=10, row=None
    )
    d6: float = parameter(
        "m",
        "distance of cylinder 1's attachment from the pivot of cylinder 2",
        default=0.25,
        source="assumed",
        least=1e-3,
        most=10,
        row=None,
    )
    gamma3: float = parameter(
        "rad",
        "direction from the pivot of cylinder 2 to that of cylinder 1",
        default=math.pi / 2,
        source="assumed",
        least=-math.pi,
        most=math.pi,
        row=None,
    )
    k1: float = parameter("m", "offset of cylinder 1, r4 = y1 + k1 (2)", default=0.430, source="assumed", least=1e-3, most=10)
    k2: float = parameter("m", "offset of cylinder 2, r2 = y2 + k2 (2)", default=0.500, source="assumed", least=1e-3, most=10)

    d_squares = derived("m2", "d3^2 + d6^2", lambda own: own.d3 * own.d3 + own.d6 * own.d6)
    d_product = derived("m2", "2 d3 d6", lambda own: 2 * own.d3 * own.d6)
    sin_gamma3 = derived("1", "sin(gamma3)", lambda own: exact.number("sine", own.gamma3))
    cos_gamma3 = derived("1", "cos(gamma3)", lambda own: exact.number("cosine", own.gamma3))


@dataclass(frozen=True)
class Cylinder(Section):
    """One double-acting, single-rod pneumatic cylinder."""

    piston_diameter: float = parameter(
        "m", "diameter of the bore", default=0.025, source="Table I", least=1e-3, most=1, row=None
    )
    rod_diameter: float = parameter(
        "m", "diameter of the rod", default=0.010, source="Table I, from its 295 and 247 N", least=0, row=None
    )
    stroke: float = parameter("m", "travel", default=0.200, source="Table I", least=1e-3, most=10, shared=True, row=None)
    coulomb_friction: float = parameter(
        "N",
        "Coulomb friction Fc, with both chambers at atmospheric pressure where it grows with theirs",
        default=8.7,
        source="assumed: with pressure_friction at mid pressures 12 N, 4-5 % of the rated force",
        least=0,
        most=1e5,
        range=(4, 18),
        identified=Prior(0.7),
        row="fc",
    )
    pressure_friction: float = parameter(
        "N/Pa",
        "growth of Coulomb friction with the sum of both gauge pressures",
        default=5e-6,
        source="0.2 to 1.2 N/bar fitted to four seals of 25 mm that Zillen 2021 measured; docs/validation.md",
        least=0,
        most=1e-3,
        range=(2e-6, 1.2e-5),
        identified=Prior(4.0, scale=1e-6),
        row="fp",
    )
    direction_asymmetry: float = parameter(
        "-",
        "share by which dry friction is larger outwards, and smaller inwards",
        default=0.0,
        source="assumed; Zhu 2006 has two levels",
        least=-0.9,
        most=0.9,
        option=True,
        range=(-0.2, 0.2),
        on_request=True,
        identified=Prior(2.0, scale=0.1, needs="direction_asymmetry"),
        row="asymmetry",
    )
    viscous_friction: float = parameter(
        "N s/m",
        "viscous friction Fv",
        default=35.0,
        source="assumed",
        least=0,
        most=1e5,
        range=(10, 60),
        identified=Prior(0.7),
        row="fv",
    )

    half_l = derived("m", "half the stroke", lambda own: own.stroke / 2)
    area_p = derived(
        "m2",
        "piston area of chamber P, the full bore",
        lambda own: math.pi / 4 * own.piston_diameter * own.piston_diameter,
    )
    area_n = derived(
        "m2",
        "piston area of chamber N, the bore less the rod",
        lambda own: math.pi / 4 * (own.piston_diameter * own.piston_diameter - own.rod_diameter * own.rod_diameter),
    )
    perimeter = derived("m", "perimeter of the bore", lambda own: np.pi * own.piston_diameter)

    def _check_together(self) -> None:
        if self.rod_diameter >= self.piston_diameter:
            raise ValueError(
                f"Cylinder.rod_diameter = {self.rod_diameter!r} is impossible; "
                f"allowed: less than piston_diameter = {self.piston_diameter!r} (m)"
            )


@dataclass(frozen=True)
class Mechanics(Section):
    """The point mass at the end effector and the end stops of the cylinders."""

    mass: float = parameter(
        "kg",
        "moving mass",
        default=3.0,
        source="assumed",
        above=0,
        most=1e20,
        range=(2, 5),
        identified=Prior(0.5),
        hardest_low=True,
    )
    gravity: float = parameter("m/s2", "acceleration of gravity", default=9.81, source="standard", least=0, most=100)
    stop_stiffness: float = parameter(
        "N/m", "stiffness k of the end stops", default=5e6, source="assumed, rigid end caps", above=0, most=1e7
    )
    stop_damping: float = parameter(
        "s/m",
        "damping c of the end stops, force k p (1 + c dp/dt)",
        default=1.0,
        source="assumed; Hunt and Crossley 1975",
        least=0,
        most=2,
    )
    impact_speed: float = parameter(
        "m/s",
        "a faster collision with an end stop is reported",
        default=0.1,
        source="assumed",
        above=0,
        most=100,
        shared=True,
        row=None,
    )
    mode_frequency: float = parameter(
        "Hz",
        "natural frequency of the handle with the linkage held; 0 is rigid",
        default=0.0,
        source="19 to 60 assumed",
        least=0,
        most=200,
        option=True,
        range=(19, 60),
        on_request=True,
        row=None,
    )
    mode_damping: float = parameter(
        "-",
        "damping ratio of the handle on the structure",
        default=0.03,
        source="assumed",
        least=0,
        most=1,
        option=True,
        range=(0.01, 0.1),
        on_request=True,
    )
    mode_mass_fraction: float = parameter(
        "-",
        "the handle's share of the mass",
        default=0.2,
        source="assumed",
        least=0.02,
        most=0.8,
        option=True,
        range=(0.1, 0.4),
        on_request=True,
        row="handle",
    )

    inverse_mass = derived("1/kg", "1/mass", lambda own: 1 / own.mass)
    mode_rate = derived("1/s", "2 pi f of the soft structure", lambda own: 2 * np.pi * own.mode_frequency)


@dataclass(frozen=True)
class Friction(Section):
    """Friction law of both pistons; the Coulomb and viscous levels belong to each cylinder."""

    law: str = parameter(
        "-",
        "friction law",
        default="lugre",
        source="LuGre (Canudas de Wit 1995), the paper's (4), elasto-plastic without presliding drift (Dupont 2002), or "
        "generalised Maxwell slip with memory of reversals (Al-Bender 2005)",
        choices=("lugre", "coulomb", "elasto_plastic", "gms"),
    )
    static_ratio: float = parameter(
        "-",
        "static over Coulomb friction, Fs/Fc",
        default=1.33,
        source="assumed",
        least=1,
        most=10,
        identified=Prior(0.7, floor=1.0),
    )
    stribeck_speed: float = parameter(
        "m/s",
        "Stribeck speed",
        default=0.015,
        source="assumed",
        least=1e-6,
        most=10,
        identified=Prior(0.7),
        row="stribeck",
    )
    bristle_stiffness: float = parameter(
        "N/m",
        "bristle stiffness s0",
        default=5e4,
        source="assumed; measured friction tells it no better than by a factor of 10",
        least=1,
        most=5e5,
        range=(5e3, 5e5),
        logarithmic=True,
        identified=Prior(1.2),
        row="s0",
    )
    bristle_damping: float = parameter(
        "N s/m", "bristle damping s1", default=150.0, source="assumed", least=0, most=2000, identified=Prior(0.7), row="s1"
    )
    breakaway_ratio: float = parameter(
        "-",
        "z_ba/z_ss of the elasto-plastic law: below this fraction of the level the bristle is a spring",
        default=0.7,
        source="assumed",
        above=0,
        most=0.9,
        row="breakaway",
    )
    attraction: float = parameter(
        "N/s",
        "attraction C of gms: how fast friction follows its level while a piston slides",
        default=1000.0,
        source="assumed",
        above=0,
        most=1e6,
        option=True,
        range=(200, 5000),
        on_request=True,
        logarithmic=True,
    )
    sign_speed: float = parameter(
        "m/s",
        "speed below which (4)'s sign(v) is v/sign_speed",
        default=0.002,
        source="numerical",
        least=0.001,
        most=10,
        hardest_low=True,
    )

    lugre = derived("1", "1 with the friction law of that name, else 0", lambda own: 1.0 * (own.law == "lugre"))
    gms = derived("1", "1 with the friction law of that name, else 0", lambda own: 1.0 * (own.law == "gms"))
    bristled = derived("1", "1 with a friction law that has bristles, else 0", lambda own: 1.0 - (own.law == "coulomb"))
    steepness = derived("1", "1/(1 - breakaway)", lambda own: 1 / (1 - own.breakaway_ratio))
    sign_slope = derived("s/m", "1/sign_speed", lambda own: 1 / own.sign_speed)
