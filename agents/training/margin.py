"""Rigs that oscillate more easily than those that a policy is for, so that it keeps a distance from where it would."""

from dataclasses import replace

from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.rig.parameters import Parameters

CALMING = (
    "mechanics.mass",
    *(f"cylinder{k}.{kind}_friction" for k in (1, 2) for kind in ("coulomb", "pressure", "viscous")),
)
"""What less of makes a rig oscillate. It also asks for less force: on rigs that are too weak there is nothing to learn."""

EXCITING = "valves.time_constant"
"""What more of does."""


def widened(rig: Parameters, margin: float) -> Parameters:
    """``rig``, whose ranges end a ``margin`` further on where it oscillates: with 0.25 masses of 2 to 5 kg begin at 1.6 kg,
    and time constants of 1.2 to 8 ms end at 10 ms. What its ranges do not have is not drawn.
    """
    ranges, known = rig.own_ranges, documented_ranges(rig)
    for name in (*CALMING, EXCITING):
        if name in known:
            low, high = known[name]
            ranges[name] = (low, high * (1.0 + margin)) if name == EXCITING else (low / (1.0 + margin), high)
    return replace(rig, ranges=tuple((name, *bounds) for name, bounds in ranges.items()))
