"""The admittance law as a stage of the closed loop: what is known, then ``law.command``; and what is known by itself."""

from baselines.admittance import knowledge, law
from baselines.admittance.rows import Beliefs, Constants, Known, Memory
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.stage import block, scratch
from birthsim_env.physics.compiled.compilation import kernel


@kernel
def control(world: int, seen: Seen, memory: int, about: Constants, tables: int, lane: int, n: int) -> int:
    """One control period of a block; returns how many stiffness setpoints are not positive definite."""
    signals, known = Seen(seen.rows[:, :n]), Known(scratch(Known.size)[:, :n])
    own = Memory(block(memory, int(about.rows_of_memory))[:, :n])
    missed = knowledge.know(signals, own, known, about)
    law.command(signals, own, known, about.gains, about.belief)
    for valve in range(4):
        for i in range(n):
            own.chambers.opening[valve, i] = signals.opening[valve, i]
    return missed


@kernel
def inform(world: int, seen: Seen, memory: int, about: Beliefs, tables: int, lane: int, n: int) -> int:
    """Hands on what is ``Known`` to who then commands by himself and writes ``Memory.chambers.opening``."""
    signals, own = Seen(seen.rows[:, :n]), Memory(block(memory, int(about.rows_of_memory))[:, :n])
    return knowledge.know(signals, own, Known(signals.handed[: Known.size]), about)
