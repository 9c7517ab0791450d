"""What the stage ``outside`` makes of a target that changes, as Python calls it."""

import numpy as np

from birthsim_build.layout import FIRST, Inputs
from birthsim_build.stages import enter_scenario, outside
from birthsim_env.loop.loop import Loop
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage


class Course:
    """A target: a trajectory, or after ``follow`` another one."""

    def __init__(self, trajectory):
        self.world, self.seen = World(np.zeros((World.size, 1))), Seen(np.zeros((Seen.size, 1)))
        self.inputs = Inputs(FIRST[:, None].copy())
        self._put(trajectory)

    def sample(self, now):
        """The target and its derivatives, (8,), at ``now``, s."""
        self.seen.time[:] = now
        self._loop.run()
        return self.seen.reference.rows[:8, 0].copy()

    def follow(self, trajectory, now):
        self.sample(now)
        self._put(trajectory)
        self.inputs.begins[:], self.inputs.passes[0] = now, 1.0
        before = self.seen.reference.rows.copy()
        self.sample(now)
        assert np.array_equal(self.seen.reference.rows, before)

    def _put(self, trajectory):
        trajectory.prepare(1)
        trajectory.begin(0, np.random.default_rng(0))
        enter, leave = (Stage(one, memory=self.inputs.rows) for one in (enter_scenario, outside))
        self._loop = Loop(1, [(self.world.rows, 0)], [(self.seen.rows, 0)], [enter, trajectory.stage(), leave])
