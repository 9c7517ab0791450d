"""The clock of a controller alone: what is measured comes from outside, and the time of it is the unit's own."""

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.records import Numbers, number


class Clock(Numbers):
    """Constants of the clock."""

    period = number("s", "control period")
    exact = number("1", "1 where positions are no samples: each is of now")


@kernel
def keep_time(world: World, seen: Seen, memory: int, constants: Clock, tables: int, lane: int, n: int) -> int:
    """The time is that of the control period that begins, counted from the start as in a closed loop."""
    for i in range(n):
        seen.time[i] = world.tick[i] * constants.period
        seen.position_time[i] = seen.time[i] if constants.exact > 0.0 else seen.position_time[i]
        world.tick[i] += 1.0
    return 0


def clock_stage(period: float, sampled: bool) -> Stage:
    """The stage before a law; positions that are ``sampled`` have a time of their own."""
    return Stage(keep_time, Clock.numbers(period=period, exact=not sampled))
