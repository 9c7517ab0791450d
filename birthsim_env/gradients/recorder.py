"""A simulation differentiated: what an action did to reward, observation and state some policy steps later.

    recorder = env.unwrapped.record()                # from now on every step is kept on a tape, with the same bits
    env.step(actions)
    back = recorder.taken()                          # the pullback of this step
    carried, by_action = back(reward=..., observation=..., carried=...)

Gradients flow through plant, actuation or law with its memory, sensors, a hand that feels the rig, reward and observation. A
sample that comes late hands its gradient to the state that it was taken of. Target, setpoints and hands that feel nothing are
functions of time. What is random is held, and what a converter rounds passes as it is.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from birthsim_env.gradients.plant import require_plain
from birthsim_env.gradients.plant_stage import ROWS, motion_traced, plant_adjoint
from birthsim_env.gradients.taped import TapedLoop
from birthsim_env.gradients.traced import Traced, trace
from birthsim_env.loop.rows import ACTION, MOTION, STATE, WORLD
from birthsim_env.loop.stage import Stage
from birthsim_env.physics.compiled.lanes import STATES, Array
from birthsim_env.reward import Terms
from birthsim_env.simulation import Simulation

OF_TIME = ("target", "setpoints", "jumps")
"""Steps of a period that are functions of time alone, or conditions; so is a hand that feels nothing."""

REWARDED, OBSERVED = 0, 3
"""Tables of what closes a policy step (``outcome.Outcome``) that get gradients from outside."""

Pullback = Callable[..., tuple[Array, Array]]


def weigh(
    bars: Any,
    at: dict[str, Any],
    carried: Any = None,
    reward: Any = None,
    observation: Any = None,
    state: Any = None,
    motion: Any = None,
) -> None:
    """Add gradients, see ``Recorder.taken``, to the rows ``at`` which their bars (rows, N) stand."""
    seen = None if observation is None else observation.T
    given = {"carried": carried, "reward": reward, "observation": seen, "state": state, "motion": motion}
    for name, gradient in given.items():
        if gradient is not None:
            bars[at[name]] += gradient


class Recorder:
    """Runs a ``simulation`` in place of its loop, and keeps what going back needs.

    ``carried`` (C,) are rows of the loop's space, and of tables after it, that hand gradients from one policy step to the one
    before: state, memories, and what is measured. Raises ``ValueError`` that names what cannot be differentiated.
    """

    arrays: Any = np
    """The module of all arrays."""

    def __init__(self, simulation: Simulation) -> None:
        require_plain(simulation.plant)
        self._simulation, self._made = simulation, object()
        simulation.recorder = self

    def run(self, periods: int, threads: int) -> int:
        """The simulation's loop, taped."""
        self.prepare()
        tape = self.loop.new_tape(periods)
        missed = self.loop.run_taped(periods, tape, threads)
        # A lane whose episode ends gets another rig before anybody asks for the pullback.
        self._last = tape, periods, self._simulation.plant.lane_parameters.copy()
        return missed

    def reached(self) -> tuple[Array, Array]:
        """Motion (4, N) of the end effector and state (18, N) of the plant now."""
        return self._simulation.motion, self._simulation.plant.state.copy()

    def taken(self) -> Pullback:
        """The pullback of the last policy step: ``back(carried=None, reward=None, observation=None, state=None, motion=None)``.

        All are gradients over N lanes of what the step has led to: ``carried`` (C, N) as the pullback of the next step gave it,
        ``reward`` (N,), ``observation`` (N, D), ``state`` (18, N) and ``motion`` (4, N), x, y, vx, vy. It returns those carried
        to the step before, and those to the action (size, N).
        """
        (tape, periods, rig), loop, at = self._last, self.loop, self.at

        def back(**given: Any) -> tuple[Array, Array]:
            bars = np.zeros((len(loop.live), rig.shape[1]))
            weigh(bars, at, **given)
            loop.back(periods, tape, rig, bars, self._simulation.threads)
            return bars[at["carried"]], bars[at["action"]]

        return back

    def prepare(self) -> None:
        """Bring the loop up to the simulation, which has begun an episode."""
        simulation = self._simulation
        if self._made is simulation.made:
            return
        require_plain(simulation.plant)  # of which an episode may have drawn an option
        pipeline, places = simulation.pipeline, simulation.places()
        named, closing = list[tuple[str, Stage]](), list[Stage]()
        for step in pipeline:
            if step.part is None:
                continue
            if not isinstance(step.part, Stage):
                raise ValueError(f"step {step.name!r} is a user's own part, in Python: no derivative; allowed: a Stage")
            if step.closes:
                closing.append(step.part)
            else:
                named.append((step.group, step.part))
        stages = [one for _, one in named]
        self.loop = loop = TapedLoop(simulation.plant.num_envs, *places, stages, closing)
        free = OF_TIME if simulation.user_force.closed_loop else (*OF_TIME, "hand")
        pieces: list[tuple[int, Stage | Traced]] = []
        for k, (name, stage) in enumerate([*named, *(("closing", one) for one in closing)]):
            if name == "plant":
                pieces += [(k, stage), (k, motion_traced())]
            elif name not in free:
                pieces.append((k, trace(stage, loop.memories[k], loop.place)))
        action = WORLD + ACTION
        rows: dict[str, Sequence[int]] = {
            "state": range(STATE, STATE + STATES), "motion": range(MOTION, MOTION + 4),
            "action": range(action, action + len(simulation.action)),
        }  # fmt: skip
        for one in closing:
            rows["reward"] = [loop.place(one.tables[REWARDED]) + Terms.total.first]
            observed = loop.place(one.tables[OBSERVED], True)
            rows["observation"] = range(observed, observed + one.tables[OBSERVED].shape[1])
        self._adjoin(pieces, rows)
        self._made = simulation.made

    def _adjoin(self, pieces: Sequence[tuple[int, Stage | Traced]], rows: dict[str, Sequence[int]]) -> None:
        """Adjoints for the rows that depend on state or action and on which depends what gets gradients from outside."""
        traced = [one for _, one in pieces if isinstance(one, Traced)]
        active = _grown({*rows["state"], *rows["action"]}, [one.depends for one in traced])
        given = {*ROWS, *(row for group in rows.values() for row in group)}
        live = sorted(active & _grown(set(given), [one.feeds for one in reversed(traced)]) | given)
        read = set(ROWS).union(*(one.feeds(set(live)) for one in traced))
        rows["carried"], rows["live"] = [row for row in live if row in read and row not in rows["action"]], live
        self.carried, self.at = np.array(rows["carried"]), {name: np.searchsorted(live, own) for name, own in rows.items()}
        found = []
        for k, piece in pieces:
            one = piece.adjoint(set(live)) if isinstance(piece, Traced) else plant_adjoint(piece)
            if one is not None:
                one.after = isinstance(piece, Traced) and piece.name == "motion"
                found.append((k, one))
        self.loop.differentiate(found, live)


def _grown(rows: set[int], ways: Sequence[Callable[[set[int]], set[int]]]) -> set[int]:
    """Rows with all that ``ways`` lead to from them."""
    before = -1
    while len(rows) > before:
        before = len(rows)
        for way in ways:
            rows |= way(rows)
    return rows
