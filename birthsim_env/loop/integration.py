"""Integrates the plant of a block of lanes, where a processor has its rows at hand.

A processor reads and writes them where they are, since a block fits its first-level cache. A thread of a graphics processor
works on copies of its lane: state, openings and force in registers, since they are the thread's alone and small; parameters,
which do not fit there as well, in memory that the threads of a block share. There they lie [parameter][thread], so that threads
side by side read words side by side.
"""

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.blocks import WARP

if not WARP:
    integrate = dynamics.integrate
else:
    from birthsim_env.physics.compiled.compilation import helper
    from birthsim_env.physics.compiled.lanes import PARAMETERS, Array
    from birthsim_env.physics.compiled.shared import shared
    from birthsim_env.physics.compiled.stack import scratch

    @helper
    def integrate(x: Array, u: Array, f: Array, p: Array, steps: int, step: float, impacts: Array, n: int) -> None:
        """``dynamics.integrate`` for a thread."""
        openings, force, fastest, rig = scratch(4), scratch(2), scratch(2), shared(PARAMETERS)
        dynamics.copy(u, openings, n)
        dynamics.copy(f, force, n)
        dynamics.copy(impacts, fastest, n)
        dynamics.copy(p, rig, n)
        dynamics.integrate(x, openings, force, rig, steps, step, fastest, n)
        dynamics.copy(fastest, impacts, n)
