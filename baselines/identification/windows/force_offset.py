"""A constant force that a log lacks: an offset of its force sensor, a cable that pulls, a hand that nobody logged."""

from dataclasses import dataclass, replace

import numpy as np

from baselines.identification.fit.estimate import Fit
from baselines.identification.fit.one_step import one_step
from baselines.identification.windows.starts import predicted
from birthsim_env.physics.compiled.lanes import Array

STEP = 0.1
"""N of the differences."""

SURE, LEAST = 4.0, 1.0
"""Standard deviations and N from which a force is named; assumed."""


@dataclass(frozen=True)
class ForceOffset:
    """The constant ``force`` (2,), N, that would make the predictions of a fit better, and its standard ``deviation`` (2,).

    On a rail it is (1,), along it.
    """

    force: Array
    deviation: Array

    @property
    def is_there(self) -> bool:
        """Whether the force is more than noise and more than is of interest."""
        return bool(np.any((np.abs(self.force) > SURE * self.deviation) & (np.abs(self.force) > LEAST)))

    def words(self) -> str:
        """The force and what may be its cause."""
        parts = ", ".join(f"{part:.2g}" for part in self.force)
        return (
            f"a constant force of ({parts}) N acts on the rig that the log lacks: an offset of the force sensor (tare "
            "it), a cable that pulls, a hand that is not logged"
        )


def force_offset(fit: Fit) -> ForceOffset:
    """One Gauss-Newton step of a fit, in which all else gives way as well (``one_step``)."""
    problem = fit.problem
    free, residual = problem.settled(fit.theta)
    windows = problem.offsets.corrected()
    columns = []
    trial, angle = windows.trial, problem.rig_at(fit.theta).linkage.inclination
    directions = np.eye(2) if trial.axes == 2 else np.array([[np.cos(angle), np.sin(angle)]])
    for direction in directions:
        forces = trial.forces + STEP * direction[:, None]
        pushed = replace(windows, trial=replace(trial, forces=forces))
        columns.append((predicted(pushed, problem.noise, [fit.rig], free[None])[0] - residual) / STEP)
    found = one_step(fit, np.stack(columns, axis=2))
    return ForceOffset(found.value, found.deviation)
