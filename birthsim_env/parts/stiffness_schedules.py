"""Setpoints over time: closed-loop stiffness (steps, as a user may change it at any control period) and pneumatic
stiffness (minimum-jerk transitions, since a chamber takes time to fill)."""

import copy
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np

from birthsim_env.loop.loop import sampled
from birthsim_env.loop.rows import REFERENCE, Seen
from birthsim_env.loop.signals import Motion, Setpoints
from birthsim_env.loop.stage import Stage, Staged, numbers, table3
from birthsim_env.parts.drawn.seeding import Range, draw, put, vectorised
from birthsim_env.parts.references import LONGEST, SHORTEST, minimum_jerk
from birthsim_env.parts.times import Timed
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, row, rows
from birthsim_env.physics.rig.values import checked_number, checked_range, shown
from birthsim_env.restored import Declared, Kept

SOFTEST, STIFFEST = 1e-3, 1e7
"""N/m: setpoints that can be asked for; steel rods of this size are as stiff."""


class StiffnessSchedule(Staged):
    """What stiffness is asked for, in phases.

    Sequences have one entry per phase: a number, or a range (low, high), from which every episode draws.

    Parameters
    ----------
    times : sequence of float
        s at which the phases start, the first 0.
    closed_loop : sequence of float
        Closed-loop stiffness, N/m, of both axes, or of x alone where ``closed_loop_y`` is given.
    pneumatic1, pneumatic2 : sequence of float
        Pneumatic stiffness of cylinders 1 and 2, N/m.
    closed_loop_y : sequence of float, optional
        Closed-loop stiffness along y, N/m.
    closed_loop_xy : sequence of float, optional
        What couples the axes, N/m; its square must be below the product of their stiffnesses.
    transition : float
        s that a change of the pneumatic stiffness takes, at minimum jerk; that of the closed loop is a step.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.

    Notes
    -----
    A schedule of your own derives from this class and overrides ``sample(time)``, which gets the time of every lane, s, (N,),
    and returns (7, N): Kclx, Kcly (N/m), the pneumatic stiffness setpoints of cylinders 1 and 2 (N/m), their rates (N/(m s)),
    and Kclxy (N/m). ``timed`` says when it changes something.

    Examples
    --------
    From 2000 to 4000 N/m after 8 s, as in Fig. 4 of the paper:

    >>> import birthsim
    >>> doubled = birthsim.StiffnessSchedule((0.0, 8.0), (2000.0, 4000.0), (4600.0, 3600.0), (2300.0, 1800.0))
    >>> env = birthsim.make("BirthSIM/Circle-v2", stiffness=doubled)
    >>> observation, info = env.reset(seed=0)
    >>> info["stiffness_setpoint"].tolist()
    [2000.0, 2000.0]
    """

    timed: Timed | None = None

    in_state: ClassVar[Declared] = {"_values": Kept(SOFTEST, STIFFEST, at=(slice(None), slice(0, 4)))}
    """Of the coupling, the last row, what is allowed hangs on the others."""

    def __init__(
        self,
        times: Sequence[float] = (0.0,),
        closed_loop: Sequence[Range] = (2000.0,),
        pneumatic1: Sequence[Range] = (4600.0,),
        pneumatic2: Sequence[Range] = (2300.0,),
        closed_loop_y: Sequence[Range] | None = None,
        closed_loop_xy: Sequence[Range] | None = None,
        transition: float = 0.5,
    ) -> None:
        for name, column in (
            ("times", times),
            ("closed_loop", closed_loop),
            ("pneumatic1", pneumatic1),
            ("pneumatic2", pneumatic2),
            ("closed_loop_y", closed_loop_y),
            ("closed_loop_xy", closed_loop_xy),
        ):
            optional = name in ("closed_loop_y", "closed_loop_xy")
            if not (isinstance(column, (tuple, list)) or (optional and column is None)):
                raise ValueError(f"{name} = {shown(column)}; allowed: a tuple with an entry per phase")
        for instant in times:
            checked_number("times", instant, "s", least=0.0, most=LONGEST)
        columns = [closed_loop, pneumatic1, pneumatic2] + ([closed_loop_y] if closed_loop_y is not None else [])
        coupled = [] if closed_loop_xy is None else [closed_loop_xy]
        if len(times) == 0 or times[0] != 0 or any(len(column) != len(times) for column in columns + coupled):
            raise ValueError(f"times = {shown(times)}; allowed: starting at 0, with as many setpoints as times")
        if not all(sooner < later for sooner, later in pairwise(times)):
            raise ValueError(f"times = {shown(times)}; allowed: increasing (s)")
        for setpoint in (entry for column in columns for entry in column):
            checked_range("stiffness setpoint", setpoint, "N/m", least=SOFTEST, most=STIFFEST)
        for across in closed_loop_xy or ():
            checked_range("closed_loop_xy", across, "N/m", least=-STIFFEST, most=STIFFEST)
        checked_number("transition", transition, "s", least=SHORTEST, most=LONGEST)
        self.times, self.transition = times, transition
        self.closed_loop, self.closed_loop_y, self.closed_loop_xy = closed_loop, closed_loop_y, closed_loop_xy
        for across, x, y in zip(closed_loop_xy or (), closed_loop, closed_loop_y or closed_loop, strict=False):
            if not np.max(np.abs(across)) ** 2 < np.min(x) * np.min(y):
                raise ValueError(f"closed_loop_xy {across!r}; allowed: below sqrt(Kclx Kcly), here of {x!r} and {y!r} (N/m)")
        self.pneumatic1, self.pneumatic2 = pneumatic1, pneumatic2
        self.timed = Timed(np.array(times, dtype=np.float64), float(times[min(1, len(times) - 1)]))

    def prepare(self, num_envs: int) -> None:
        """Make room for ``num_envs`` lanes."""
        self._starts: Array = np.array(self.times, dtype=np.float64)
        self._values: Array = np.zeros((len(self.times), Phase.size, num_envs))

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""
        for phase in range(len(self.times)):
            x = draw(self.closed_loop[phase], rng)
            y = x if self.closed_loop_y is None else draw(self.closed_loop_y[phase], rng)
            pneumatic = draw(self.pneumatic1[phase], rng), draw(self.pneumatic2[phase], rng)
            across = 0.0 if self.closed_loop_xy is None else draw(self.closed_loop_xy[phase], rng)
            put(self._values[phase], lane, (x, y, *pneumatic, across))

    def some(self, lanes: Any) -> Self:
        """The same for lanes (L,) alone."""
        few = copy.copy(self)
        few._values = self._values.take(lanes, axis=2)
        return few

    @vectorised
    def sample(self, time: Array) -> Array:
        """Setpoints (7, N) at ``time`` (N,), s."""
        return sampled(self.stage(), time, REFERENCE + Motion.size, Setpoints.size)

    def stage(self) -> Stage:
        """``sample``, compiled into the closed loop."""
        return Stage(_schedule, Schedule.numbers(transition=self.transition, starts=self._starts), tables=(self._values,))


class Phase(Rows):
    """What is asked for in one phase."""

    stiffness = rows("Kclx Kcly", "N/m", "closed-loop stiffness")
    pneumatic = rows("Kpneu1 Kpneu2", "N/m", "pneumatic stiffness")
    coupling = row("N/m", "closed-loop stiffness that couples x and y")


class Schedule(Numbers):
    """When it is asked for."""

    transition = number("s", "how long a change of the pneumatic stiffness takes")
    starts = rows(0, "s", "of the phases")


@kernel
def _schedule(world: int, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Constants: ``Schedule``; table (P, 5, N): what is asked for in each ``Phase``."""
    every, time, asked = table3(tables, 0), seen.time, seen.reference
    schedule, values = Schedule(numbers(constants, Schedule.size + every.shape[0])), every[:, :, lane : lane + n]
    starts, transition = schedule.starts, schedule.transition
    for i in range(n):
        k = 0
        # Half a microsecond of grace: a phase that starts on a control instant starts there, whatever the rounding.
        while k + 1 < starts.shape[0] and time[i] >= starts[k + 1] - 5e-7:
            k += 1
        earlier = max(k - 1, 0)
        phase, last, u = Phase(values[k]), Phase(values[earlier]), (time[i] - starts[k]) / transition
        asked.stiffness_coupling[i] = phase.coupling[i]
        for axis in range(2):
            asked.stiffness[axis, i] = phase.stiffness[axis, i]
            now, before = phase.pneumatic[axis, i], last.pneumatic[axis, i]
            asked.pneumatic_stiffness[axis, i] = before + (now - before) * minimum_jerk(u, 0)
            asked.pneumatic_stiffness_rate[axis, i] = (now - before) * minimum_jerk(u, 1) / transition
    return 0
