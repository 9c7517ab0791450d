"""What the sections of a rig must fulfil together, and what of them follows where another one changes."""

import dataclasses
import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from birthsim_env.physics.step import STEP

if TYPE_CHECKING:
    from birthsim_env.physics.rig.parameters import Parameters

STOP_DEPTH = 0.01
"""m of piston travel that every chamber must keep as dead volume; collisions seen in tests go 5 mm deep."""


def check_together(rig: "Parameters") -> None:
    """Raise ``ValueError`` for values that are possible one by one but not together: field, value, what is allowed."""
    _check_linkage(rig)
    _check_dead_volume(rig)
    _check_stability(rig)


def _check_linkage(rig: "Parameters") -> None:
    g, has = rig.geometry, rig.linkage.topology.has
    if rig.linkage.is_rail:
        for name, value in rig.linkage.locked_geometry(g.d3, g.d6).items():
            if getattr(g, name) != value:
                raise ValueError(
                    f"Geometry.{name} = {getattr(g, name)!r} is impossible on a rail; allowed: {value!r}, which follows from "
                    f"linkage.inclination = {rig.linkage.inclination!r} rad where it is not named"
                )
    for name, offset, cylinder in (("k1", g.k1, rig.cylinder1), ("k2", g.k2, rig.cylinder2)):
        if has(f"cylinder{name[-1]}") and offset <= 0.55 * cylinder.stroke:
            raise ValueError(
                f"Geometry.{name} = {offset!r} is impossible; allowed: more than {0.55 * cylinder.stroke:g} m, "
                f"0.55 strokes, so that the cylinder's length stays positive"
            )
    if not has("cylinder1"):
        return
    shortest, longest = abs(g.d3 - g.d6), g.d3 + g.d6
    least, most = g.k1 - rig.cylinder1.stroke / 2, g.k1 + rig.cylinder1.stroke / 2
    if not shortest * 1.05 < least < most < longest * 0.98:
        raise ValueError(
            f"Geometry.k1 = {g.k1!r} with stroke {rig.cylinder1.stroke!r} is impossible; allowed: cylinder 1's "
            f"length {least:g} to {most:g} m must lie in {shortest * 1.05:g} to {longest * 0.98:g} m"
        )


def _check_dead_volume(rig: "Parameters") -> None:
    # A hard collision pushes a piston millimetres into its end stop; the chamber there must not lose all its volume.
    least = least_dead_volume(rig)
    if rig.chambers.dead_volume < least:
        raise ValueError(
            f"Chambers.dead_volume = {rig.chambers.dead_volume!r} is impossible; allowed: at least {least:.3g} m3, "
            f"{1e3 * STOP_DEPTH:g} mm of the largest piston"
        )


def _check_stability(rig: "Parameters") -> None:
    f, moving = rig.friction, [getattr(rig, name) for name in rig.linkage.topology.cylinder_names]
    viscous, coulomb = (max(getattr(one, f"{name}_friction") for one in moving) for name in ("viscous", "coulomb"))
    damping = viscous + (coulomb / f.sign_speed if f.law == "coulomb" else f.bristle_damping)
    m = rig.mechanics
    damping /= 1 - m.mode_mass_fraction if m.mode_frequency else 1
    steps = f"so that steps of {1e3 * STEP.seconds:.2g} ms follow"
    if damping / m.mass > STEP.fastest_rate:
        raise ValueError(
            f"Mechanics.mass = {m.mass!r} is impossible with this friction; allowed: at least "
            f"{damping / STEP.fastest_rate:.3g} kg, or less friction, {steps} the motion"
        )
    volume = settling_volume(rig)
    if rig.chambers.whole_dead_volume < volume / STEP.fastest_air:
        raise ValueError(
            f"Chambers.dead_volume = {rig.chambers.dead_volume!r} is impossible with these valves; allowed: at least "
            f"{volume / STEP.fastest_air:.3g} m3 with the tube's, or smaller valves, {steps} the pressure"
        )


def settling_volume(rig: "Parameters") -> float:
    """m3/s. Over a chamber's volume it is the rate at which its pressure follows another close to it through an open valve.

    There the flow is linear in the difference of the pressures: gamma r T dq/dP, of ``valves.laminar_slope``.
    """
    air, valves = rig.air, rig.valves
    slope = valves.sonic_conductance * air.reference_density * math.sqrt(air.coldness) * valves.laminar
    return float(air.heat_capacity_ratio * air.gas_constant * air.temperature * slope)


def least_dead_volume(rig: "Parameters") -> float:
    """The least possible of a rig, m3: ``STOP_DEPTH`` of its largest piston."""
    return float(STOP_DEPTH * max(getattr(rig, name).area_p for name in rig.linkage.topology.cylinder_names))


def follow(parts: dict[str, Any], rig: "Parameters", changes: dict[str, Any]) -> None:
    """Put into ``parts`` of a changed ``rig`` what hangs on its bores and strokes, as far as ``changes`` do not name it."""

    def part(name: str) -> Any:
        return parts.get(name, getattr(rig, name))

    def bore(own: Callable[[str], Any]) -> float:
        return float(max(own(name).area_p for name in part("linkage").topology.cylinder_names))

    grown = bore(part) / bore(partial(getattr, rig))
    if grown != 1.0 and "chambers.dead_volume" not in changes:
        parts["chambers"] = dataclasses.replace(part("chambers"), dead_volume=grown * rig.chambers.dead_volume)
    g = part("geometry")
    if part("linkage").is_rail:
        named = {name for section, _, name in (dotted.partition(".") for dotted in changes) if section == "geometry"}
        own = part("linkage").locked_geometry(g.d3, g.d6)
        g = dataclasses.replace(g, **{name: value for name, value in own.items() if name not in named})
    elif not {"geometry.d3", "geometry.d6", "geometry.k1"} & set(changes):
        room = 1.9 * min(0.98 * (g.d3 + g.d6) - g.k1, g.k1 - 1.05 * abs(g.d3 - g.d6))
        longer = max(1.0, part("cylinder1").stroke / max(room, rig.cylinder1.stroke))
        if longer > 1.0:
            g = dataclasses.replace(g, d3=longer * g.d3, d6=longer * g.d6, k1=longer * g.k1)
    if part("cylinder2").stroke > rig.cylinder2.stroke and "geometry.k2" not in changes:
        g = dataclasses.replace(g, k2=max(g.k2, 0.6 * part("cylinder2").stroke))
    if g is not part("geometry"):
        parts["geometry"] = g
