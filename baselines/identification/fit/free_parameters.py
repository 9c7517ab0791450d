"""What is identified: parameters of a rig, how they are scaled, and how far from the owner's value they may lie."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from baselines.identification.log.trial import ENCODERS, TRACKER
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.consistency import least_dead_volume, settling_volume
from birthsim_env.physics.rig.declaration import Prior
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of
from birthsim_env.physics.step import STEP


class FreeParameter(NamedTuple):
    """A parameter that is identified, and what is known of it beforehand (``declaration.Prior``)."""

    name: str
    prior: Prior


LATENCY = TRACKER

ORDER = ("cylinder1", "cylinder2", "friction", "mechanics", "valves", "chambers")
"""Sections in the order in which estimates are shown; others come behind."""


def _place(section: str) -> int:
    return (*ORDER, section).index(section)


def _declared(more: bool) -> tuple[FreeParameter, ...]:
    """What is identified, of rigs in general, or where the rig has ``more`` than the default one."""
    return tuple(
        FreeParameter(name, one.identified)
        for name, one in sorted(DECLARED.items(), key=lambda item: _place(item[0].partition(".")[0]))
        if one.identified and bool(one.identified.needs) == more and name != ENCODERS
    )


FREE_PARAMETERS = _declared(more=False)
"""What is identified of any rig: the parameters that are declared so."""

FURTHER_PARAMETERS = _declared(more=True)
"""What is identified where the owner's rig has it, or the log shows that it is there (``Prior.needs``)."""


def free_of(owner: Parameters, latency: str = TRACKER) -> tuple[FreeParameter, ...]:
    """What is identified of a rig as its owner describes it, from a log whose positions have a ``latency``."""
    asked = (one for one in FURTHER_PARAMETERS if not _is_default(owner, _needed(one)))
    late = DECLARED[latency].identified
    assert late, "latencies are declared to be identified"
    usual = (one for one in FREE_PARAMETERS if one.name != TRACKER)
    every = (*usual, *asked, FreeParameter(latency, late))
    return _in_order(one for one in every if owner.linkage.topology.has(one.name))


def shown_by(owner: Parameters) -> tuple[FreeParameter, ...]:
    """What a log may show though the owner's rig lacks it."""
    return tuple(
        one
        for one in FURTHER_PARAMETERS
        if one.prior.scale
        and _needed(one) == one.name
        and _is_default(owner, one.name)
        and owner.linkage.topology.has(one.name)
    )


def with_more(free: tuple[FreeParameter, ...], more: Iterable[FreeParameter]) -> tuple[FreeParameter, ...]:
    """``free`` and ``more`` in the order in which estimates are shown."""
    return _in_order((*free, *more))


def _needed(one: FreeParameter) -> str:
    return f"{one.name.partition('.')[0]}.{one.prior.needs}"


def _is_default(rig: Parameters, name: str) -> bool:
    return bool(value_of(rig, name) == DECLARED[name].default)


def _in_order(free: Iterable[FreeParameter]) -> tuple[FreeParameter, ...]:
    places = list(DECLARED)
    return tuple(sorted(free, key=lambda one: (_place(one.name.partition(".")[0]), places.index(one.name))))


FURTHEST = 3.5
"""Spreads from the owner's value within which a parameter is looked for."""

INSIDE = 1e-3
"""Coordinates by which the search stays within what the rig's description allows, more than a step of differences."""


def unmeasured(rig: Parameters) -> Parameters:
    """``rig`` as it is known before its log: what is identified has the default rig's values."""
    known = {one.name: value_of(Parameters(), one.name) for one in FREE_PARAMETERS}
    known["chambers.dead_volume"] = max(known["chambers.dead_volume"], least_dead_volume(rig))
    return rig.replace(known)


def limits(rig: Parameters, free: tuple[FreeParameter, ...]) -> tuple[Array, Array]:
    """The least and the largest coordinates (Q,) that are looked at, for the rig as its owner describes it."""
    low, high = [], []
    for one, centre in zip(free, coordinates(rig, free), strict=True):
        declared, prior = DECLARED[one.name], one.prior
        least = max(declared.least, declared.above, least_dead_volume(rig) if one.name == "chambers.dead_volume" else -math.inf)
        low.append(max(prior.coordinate(least) + INSIDE, centre - FURTHEST * prior.spread))
        high.append(min(prior.coordinate(declared.most) - INSIDE, centre + FURTHEST * prior.spread))
    return np.array(low), np.array(high)


def coordinates(rig: Parameters, free: tuple[FreeParameter, ...]) -> Array:
    """The coordinates (Q,) of a rig."""
    return np.array([one.prior.coordinate(value_of(rig, one.name)) for one in free])


def rig_at(rig: Parameters, free: tuple[FreeParameter, ...], theta: Array) -> Parameters:
    """``rig`` with the values at coordinates (Q,), the nearest that a step of the integrator can follow.

    A search comes by large valves on small chambers, and by dampers on light heads: the dead volume and the mass of such a rig
    are the least possible ones.
    """
    changes = {one.name: one.prior.value(float(c)) for one, c in zip(free, theta, strict=True)}
    try:
        return rig.replace(changes)
    except ValueError:
        return rig.replace(changes | _possible(rig, changes))


def _possible(rig: Parameters, changes: dict[str, float]) -> dict[str, float]:
    """Mass and dead volume that let steps of the integrator follow a rig with ``changes``, no less than there."""
    volume, mass = "chambers.dead_volume", "mechanics.mass"
    large = rig.replace(changes | {volume: 1e3, mass: 1e9})
    tube = large.chambers.whole_dead_volume - large.chambers.dead_volume
    viscous = max(getattr(large, name).viscous_friction for name in rig.linkage.topology.cylinder_names)
    least = {
        volume: settling_volume(large) / STEP.fastest_air - tube,
        mass: (viscous + large.friction.bristle_damping) / STEP.fastest_rate,
    }
    return {name: max(changes.get(name, value_of(rig, name)), (1.0 + 1e-9) * at_least) for name, at_least in least.items()}
