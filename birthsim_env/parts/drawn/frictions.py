"""Frictions of plants whose controllers may believe another: the sweep of tables, of tuning and of training, declared once.

    [randomize]
    friction = "drawn"

in the file of a rig draws the friction of each episode from an entry of this sweep, wherever rigs are drawn. Controllers go on
believing what the rest of the file says. What an entry does not name is as the rig says, or drawn from its documented range.
All entries draw the same parameters, some from a range without width, so that a seed has one rig under all of them, of which
only the friction differs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from birthsim_env.physics.rig.parameters import FRICTION, Parameters, value_of
from birthsim_env.registry import entries, entry, register

LAW, RATIO, STIFFNESS = "friction.law", "friction.static_ratio", "friction.bristle_stiffness"
DAMPING, STRIBECK = "friction.bristle_damping", "friction.stribeck_speed"

OPTIONAL = "gms"
"""The law that is an option of the plant (``physics.options``), with states of its own: gradients do not know it, and devices
only where the rig as described has it."""


@dataclass(frozen=True)
class FrictionWorld:
    """One of ``laws`` with ``ranges``, dotted name -> (low, high), and where these come from."""

    laws: tuple[str, ...]
    ranges: Mapping[str, tuple[float, float]]
    source: str


def _both(name: str, low: float, high: float) -> dict[str, tuple[float, float]]:
    return {f"cylinder{k}.{name}": (low, high) for k in (1, 2)}


_ANY = {
    STIFFNESS: (5e3, 5e5), DAMPING: (37.5, 600.0), STRIBECK: (0.003, 0.05), RATIO: (1.0, 1.8),
    **_both("direction_asymmetry", -0.2, 0.2),
}  # fmt: skip
"""What is in doubt of a friction besides its law and its level."""

_ORDER = "measured friction tells it no better than by a factor of 10"

_SWEEP: dict[str, tuple[str, FrictionWorld]] = {
    "lugre": ("LuGre as assumed.", FrictionWorld(("lugre",), {STIFFNESS: (5e4, 5e4)}, "assumed")),
    "lugre-drawn": ("LuGre with the bristles of the documented range.", FrictionWorld(("lugre",), {}, _ORDER)),
    "lugre-soft": ("LuGre, bristles a tenth as stiff.", FrictionWorld(("lugre",), {STIFFNESS: (5e3, 5e3)}, _ORDER)),
    "lugre-stiff": ("LuGre, bristles ten times as stiff.", FrictionWorld(("lugre",), {STIFFNESS: (5e5, 5e5)}, _ORDER)),
    "lugre-damped": (
        "LuGre, bristles damped four times as much.",
        FrictionWorld(("lugre",), {DAMPING: (600.0, 600.0)}, "assumed"),
    ),
    "lugre-level": ("LuGre without stiction, Fs = Fc.", FrictionWorld(("lugre",), {RATIO: (1.0, 1.0)}, "assumed")),
    "lugre-sticky": (
        "LuGre with Fs = 1.8 Fc.",
        FrictionWorld(("lugre",), {RATIO: (1.8, 1.8)}, "assumed; Canudas de Wit 1995 has 1.5"),
    ),
    "lugre-early": (
        "LuGre that loses its stiction at 3 mm/s.",
        FrictionWorld(("lugre",), {STRIBECK: (0.003, 0.003)}, "assumed; Canudas de Wit 1995 has 1 mm/s"),
    ),
    "lugre-late": (
        "LuGre that loses its stiction at 50 mm/s.",
        FrictionWorld(("lugre",), {STRIBECK: (0.05, 0.05)}, "assumed"),
    ),
    "elasto-plastic": (
        "A spring up to 0.7 of the level: nothing creeps.",
        FrictionWorld(("elasto_plastic",), {}, "Dupont 2002"),
    ),
    "coulomb": ("The paper's law (4): no bristles, no stiction.", FrictionWorld(("coulomb",), {}, "Herzig 2015")),
    "gms": ("Generalised Maxwell slip, which remembers reversals.", FrictionWorld(("gms",), {}, "Al-Bender 2005")),
    "pressed": (
        "LuGre that grows by 1.2 N/bar; its level at mid pressures is the documented one.",
        FrictionWorld(
            ("lugre",),
            {**_both("pressure_friction", 1.2e-5, 1.2e-5), **_both("coulomb_friction", 0.0, 13.4)},
            "the most that docs/validation.md found of a seal",
        ),
    ),
    "asymmetric": (
        "LuGre that is 20 % larger outwards and smaller inwards.",
        FrictionWorld(("lugre",), _both("direction_asymmetry", 0.2, 0.2), "assumed; Zhu 2006 has two levels"),
    ),
    "drawn": (
        "One of all laws, and all that is in doubt of it drawn.",
        FrictionWorld(("lugre", "elasto_plastic", "coulomb", OPTIONAL), _ANY, "those above"),
    ),
    "drawn-smooth": (
        "As drawn, but for generalised Maxwell slip, which has no gradients.",
        FrictionWorld(("lugre", "elasto_plastic", "coulomb"), _ANY, "those above"),
    ),
}
for _place, (_name, (_about, _world)) in enumerate(_SWEEP.items()):
    register(friction=_name, about=_about, order=_place)(_world)


def with_ranges(friction: str, nominal: Parameters, documented: Mapping[str, tuple[Any, ...]]) -> dict[str, tuple[Any, ...]]:
    """``documented`` ranges of a rig with those of a ``friction`` of the sweep; ``ValueError`` for a name that is none's."""
    world: FrictionWorld = entry("friction", friction).made
    swept = sorted({name for one in entries("friction") for name in one.made.ranges})
    as_described = {name: (value_of(nominal, name),) * 2 for name in swept}
    return {LAW: world.laws, **as_described, **documented, **world.ranges}


def with_friction(rig: Parameters, friction: str) -> Parameters:
    """``rig`` about which the friction of plants is drawn from ``friction``; as it is where that is ""."""
    if not friction:
        return rig
    own = {**rig.own_ranges, FRICTION: (entry("friction", friction).name,)}
    return replace(rig, ranges=tuple((name, *bounds) for name, bounds in sorted(own.items())))
