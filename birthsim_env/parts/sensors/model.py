"""What a sensor model is. One is registered in its own file by ``@register(sensors="name", about="...")``.

``ideal`` is the simplest one, ``honest`` has all that there can be.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.loop import Loop
from birthsim_env.loop.rows import AT_VALVE, FORCE, MOTION, STATE, TICK, Signals, measurement_of
from birthsim_env.loop.signals import Measurement
from birthsim_env.loop.stage import Stage, Staged
from birthsim_env.parts.drawn.seeding import vectorised
from birthsim_env.physics.compiled.lanes import FREE, PRESSURES, Y1, Array
from birthsim_env.physics.electronics import Electronics
from birthsim_env.registry import entries, entry


class SensorModel(Staged):
    """What measures the rig, and may stand between a controller's openings and the valves too.

    ``measure`` alone makes a sensor model, and so does ``stage``, which is the same, compiled into the closed loop; all else
    has the defaults that stand here. Without a stage the loop stops for ``measure`` in Python. So it does for a class that
    derives from a compiled model and overrides ``measure`` alone. ``board_stage`` is ``put_out``, in the same way.

    Parameters
    ----------
    electronics : Electronics
        The rig's sensors and board.
    num_envs : int
        How many lanes (N) it measures.
    """

    sampled: bool = False
    """Whether it must look at every control period; else it is asked at every policy period, and positions are exact."""

    drawn: ClassVar[tuple[str, ...]] = ()
    """Dotted names of parameters, as ``"electronics.force_bias"``, that it can draw for every episode. It then has ``vary``."""

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        """Make room for ``num_envs`` lanes."""

    def vary(self, ranges: Mapping[str, tuple[float, float]]) -> None:
        """From the next episode on draw what ``ranges`` name, some of ``drawn``, uniformly in (low, high), SI units."""
        raise NotImplementedError(f"{type(self).__name__}.vary(ranges) is missing; it draws {', '.join(ranges)}")

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane, with that lane's own random stream."""

    def measure(
        self,
        ticks: NDArray[np.int64],
        time: Array,
        motion: Array,
        pressures: Array,
        force: Array,
        pistons: Array | None = None,
        rig: Array | None = None,
    ) -> Measurement:
        """What the sensors say: by default what the ``stage`` does.

        Parameters
        ----------
        ticks : array (N,)
            Control periods since the episode of each lane began.
        time : array (N,)
            The same in s.
        motion : array (4, N)
            x, y, vx, vy of the end effector, m and m/s.
        pressures : array (4, N)
            At the cells of the chambers P1, N1, P2, N2, Pa.
        force : array (2, N)
            Of the hand on the end effector, N.
        pistons : array (4, N), optional
            y1, v1, y2, v2 of both pistons, m and m/s, for what is measured at the cylinders.
        rig : array (PARAMETERS, N), optional
            The rig's parameters, ``Plant.lane_parameters``, likewise; by default both cylinders move.
        """
        stage = self.stage()
        if stage is None:
            raise NotImplementedError(
                f"{type(self).__name__} has neither measure(ticks, time, motion, pressures, force, pistons, rig) nor stage()"
            )
        seen = np.zeros((Signals.size, len(time)))
        Signals(seen).time[:] = time
        cells = [(pressures, AT_VALVE), *((pressures[[k]], STATE + row) for k, row in enumerate(PRESSURES))]
        world = [(ticks[None], TICK), (motion, MOTION), (force, FORCE), *cells]
        world += [(np.ones((1, len(time))), FREE) if rig is None else (rig, 0)]
        world += [] if pistons is None else [(pistons, STATE + Y1)]
        placed = [(np.ascontiguousarray(array, dtype=np.float64), row) for array, row in world]
        Loop(len(time), placed, [(seen, 0)], [stage]).run()
        return measurement_of(seen, self.sampled, self.tells_acceleration)

    @property
    def tells_acceleration(self) -> bool:
        """Whether the ``stage`` measures the acceleration of the end effector."""
        return False

    @property
    def has_board(self) -> bool:
        """Whether openings pass through ``put_out`` on their way to the valves."""
        return type(self).put_out is not SensorModel.put_out

    def put_out(self, ticks: NDArray[np.int64], openings: Array) -> Array:
        """What reaches the valves of ``openings`` (4, N), -1 to 1, commanded at ``ticks`` (N,): all of it, without a board."""
        return openings

    def board_stage(self) -> Stage | None:
        """``put_out``, compiled into the closed loop; None where it is Python, or there is no board."""
        return None


def drawn_by(sensors: str) -> tuple[str, ...]:
    """Dotted names of the parameters that the sensor model ``sensors`` can draw for every episode."""
    drawn: tuple[str, ...] = entry("sensors", sensors).made.drawn
    return drawn


def models_that_draw() -> list[str]:
    """Names of the sensor models that can draw parameters for every episode."""
    return [model.name for model in entries("sensors") if model.made.drawn]
