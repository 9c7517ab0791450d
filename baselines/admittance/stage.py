"""The admittance law as a stage of the closed loop: what is known, then ``law.command``."""

from baselines.admittance import knowledge, law
from baselines.admittance.rows import Constants, Known, Memory
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
