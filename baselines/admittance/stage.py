"""The admittance law as a stage of the closed loop: what is known, then ``law.command``; and what is known by itself."""

from __future__ import annotations

from baselines.admittance import knowledge, law
from baselines.admittance.knowledge import (
    BELIEVED,
    FORCE,
    JOINTS,
    KNOWN,
    MEMORY,
    MOTION,
    MOVING,
    OPENED,
    PERIOD,
    PRESSURES,
    ROWS,
    SPOOLS,
    TRACKER,
    UNSEEN,
)
from baselines.estimation import observers
from birthsim_env.loop.rows import ACTION, ASKED, FEEDFORWARD, HANDED, OPENING, SEEN, SHOWN
from birthsim_env.loop.stage import block, numbers, scratch
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS

LAW, GAINS = MEMORY, len(knowledge.CONSTANTS)
"""Where the law's own rows of memory and its gains begin."""
PISTONS, NUMBERS = LAW + law.MEMORY, GAINS + len(law.GAIN_NAMES)
"""Where the observer of the pistons and the rig follow them."""


@kernel
def control(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """One control period of a block; returns how many stiffness setpoints are not positive definite."""
    s, about = block(seen, SEEN)[:, :n], numbers(constants, NUMBERS + PARAMETERS)
    m, known, p = block(memory, PISTONS + int(about[ROWS]))[:, :n], scratch(KNOWN)[:, :n], about[NUMBERS:]
    pistons, openings = m[PISTONS:], s[OPENING:SHOWN]
    missed = knowledge.know(s, m, pistons, about, p, known, n)
    law.command(
        m[JOINTS:TRACKER], m[PRESSURES:OPENED], known[MOTION:MOVING], s[ASKED:FEEDFORWARD], known[FORCE:BELIEVED],
        known[UNSEEN : UNSEEN + 2], pistons[observers.REST : observers.INNOVATION], known[MOVING], m[SPOOLS:PRESSURES], p,
        about[PERIOD], about[GAINS:NUMBERS], s[FEEDFORWARD:ACTION], m[LAW:PISTONS], openings,
    )  # fmt: skip
    for valve in range(4):
        for i in range(n):
            m[OPENED + valve, i] = openings[valve, i]
    return missed


@kernel
def inform(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Hands on what is known, ``KNOWN`` rows from ``HANDED`` on, to who then commands by himself and writes ``OPENED``."""
    s, about = block(seen, SEEN)[:, :n], numbers(constants, GAINS + PARAMETERS)
    m, known = block(memory, MEMORY + int(about[ROWS]))[:, :n], s[HANDED : HANDED + KNOWN]
    return knowledge.know(s, m, m[MEMORY:], about, about[GAINS:], known, n)
