"""A simulation differentiated: what an action did to reward, observation and state some policy steps later.

    recorder = Recorder(env.unwrapped.simulation)    # from now on every step is kept on a tape, with the same bits
    env.step(actions)
    back = recorder.taken()                          # the pullback of this step
    carried, by_action = back(reward=..., observation=..., carried=...)

Gradients flow through plant, actuation or law with its memory, ideal sensors, reward and observation. Target, setpoints and
hands that feel nothing are functions of time. What is random is held.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from birthsim_env.loop.gradients.plant import motion_traced, plant_adjoint
from birthsim_env.loop.gradients.taped import TapedLoop
from birthsim_env.loop.gradients.traced import Adjoint, Traced, trace
from birthsim_env.loop.rows import ACTION, MOTION, STATE, WORLD
from birthsim_env.loop.stage import Stage
from birthsim_env.physics.compiled.lanes import STATES, Array
from birthsim_env.physics.gradients.plant import require_plain
from birthsim_env.reward import Terms
from birthsim_env.simulation import Simulation

OF_TIME = ("target", "setpoints", "hand", "jumps")
"""Parts of a period that are functions of time alone, for a hand that feels nothing."""

REWARDED, OBSERVED = 0, 3
"""Tables of what closes a policy step (``outcome.Outcome``) whose gradients are known."""

Pullback = Callable[..., tuple[Array, Array]]


class Recorder:
    """Runs a simulation in place of its loop, and keeps what going back needs.

    ``carried`` (C,) are rows of the loop's space that hand gradients from one policy step to the one before: state, memories,
    and what is measured. Raises ``ValueError`` that names what cannot be differentiated.
    """

    def __init__(self, simulation: Simulation) -> None:
        require_plain(simulation.plant)
        if simulation.user_force.closed_loop:
            raise ValueError(
                f"user_force = {type(simulation.user_force).__name__}, which feels the rig; allowed: a hand that does not"
            )
        self._simulation, self._made = simulation, object()
        simulation.recorder = self

    def run(self, periods: int, threads: int) -> int:
        """The simulation's loop, taped."""
        self.prepare()
        tape = self._loop.new_tape(periods)
        missed = self._loop.run_taped(periods, tape, threads)
        self._last = tape, periods
        return missed

    def taken(self) -> Pullback:
        """The pullback of the last policy step: ``back(carried=None, reward=None, observation=None, state=None, motion=None)``.

        All are gradients over N lanes of what the step has led to: ``carried`` (C, N) as the pullback of the next step gave it,
        ``reward`` (N,), ``observation`` (N, D), ``state`` (18, N) and ``motion`` (4, N), x, y, vx, vy. It returns those carried
        to the step before, and those to the action (size, N).
        """
        (tape, periods), rig, loop = self._last, self._simulation.plant.lane_parameters.copy(), self._loop
        size, lanes = len(self._simulation.action), self._simulation.plant.num_envs
        first = self._extras

        def back(
            carried: Array | None = None, reward: Array | None = None, observation: Any = None, state: Array | None = None,
            motion: Array | None = None,
        ) -> tuple[Array, Array]:  # fmt: skip
            bars = np.zeros((first + self._outputs, lanes))
            if carried is not None:
                bars[self.carried] = carried
            for where, given in ((STATE, state), (MOTION, motion)):
                if given is not None:
                    bars[where : where + len(given)] += given
            if reward is not None:
                bars[first] = reward
            if observation is not None:
                bars[first + 1 : first + 1 + observation.shape[1]] = observation.T
            loop.back(periods, tape, rig, bars, self._simulation.threads)
            action = WORLD + ACTION
            return bars[self.carried], bars[action : action + size]

        return back

    def prepare(self) -> None:
        """Bring the loop up to the simulation, which has begun an episode."""
        simulation = self._simulation
        if self._made is simulation.made:
            return
        parts, places = simulation.parts(), simulation.places()
        own = [one for group in parts.values() for one in group if not isinstance(one, Stage)]
        if own:
            raise ValueError(f"{own[0]}, a user's own part, cannot be differentiated; allowed: those of the package")
        named = [(name, one) for name, group in parts.items() for one in group if isinstance(one, Stage)]
        stages = [one for _, one in named]
        self._loop = TapedLoop(simulation.plant.num_envs, *places, stages, simulation.closing)
        memories, self._extras = self._loop.memories, self._loop.rows
        pieces: list[tuple[int, Traced | None]] = []
        for k, (name, stage) in enumerate(named):
            if name == "plant":
                pieces += [(k, None), (k, motion_traced())]
            elif name not in OF_TIME:
                pieces.append((k, trace(stage, memories[k])))
        self._outputs = 0
        for k, stage in enumerate(simulation.closing, len(stages)):
            closing = trace(stage, memories[k], self._extras, _wanted)
            self._outputs += len(closing.extras)
            pieces.append((k, closing))
        self._loop.differentiate(self._adjoints(pieces, stages))
        self._made = simulation.made

    def _adjoints(self, pieces: Sequence[tuple[int, Traced | None]], stages: Sequence[Stage]) -> list[tuple[int, Adjoint]]:
        """Adjoints for the rows that depend on state or action, or on what these have led to."""
        state = set(range(STATE, STATE + STATES))
        actions = set(range(WORLD + ACTION, WORLD + ACTION + len(self._simulation.action)))
        active, before = state | actions, -1
        while len(active) > before:
            before = len(active)
            for _, traced in pieces:
                if traced is not None:
                    active |= traced.depends(active)
        self.carried = np.array(sorted(row for row in active - actions if row < self._extras))
        found = []
        for k, traced in pieces:
            one = plant_adjoint(stages[k]) if traced is None else traced.adjoint(active)
            one.after = traced is not None and traced.name == "motion"
            found.append((k, one))
        return found


def _wanted(table: int, row: int) -> bool:
    return table == OBSERVED or (table == REWARDED and row == Terms.total.first)
