"""A law that is told another rig in each lane."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from baselines.impedance import Impedance, declared_by
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.loop.stage import address_of, call, numbers
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array

ADDRESS, COUNT = range(2)
"""Numbers before the constants of the lanes: the address of a stage, exact below 2^53, and how many constants a lane has."""

HEAD, NUMBER = 2, 8
"""How many there are, and bytes of a number."""


@kernel
def each(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """A stage on one column of the block after another, with the constants of each lane."""
    head, missed = numbers(constants, HEAD), 0
    for i in range(n):
        own = constants + NUMBER * (HEAD + (lane + i) * int(head[COUNT]))
        missed += call(int(head[ADDRESS]), world, seen + NUMBER * i, memory + NUMBER * i, own, tables, lane + i, 1)
    return missed


class Privileged(StagedController):
    """``laws``, one a lane, of the same stages with other constants, as one compiled law."""

    def __init__(self, laws: Sequence[StagedController]) -> None:
        super().__init__(laws[0].parameters)
        self._laws = laws

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        stages = list(zip(*(law.controller_stages(sampled) for law in self._laws), strict=True))
        self._fresh = [_abreast([one.fresh for one in lanes]) for lanes in stages]
        heads = [[address_of(lanes[0].function), len(lanes[0].constants)] for lanes in stages]
        return [
            ControllerStage(
                each,
                np.concatenate([np.array(head, dtype=np.float64), *(one.constants for one in lanes)]),
                fresh[:, 0],
                lanes[0].reads_acceleration,
            )
            for lanes, fresh, head in zip(stages, self._fresh, heads, strict=True)
        ]

    def begin(self, lanes: Mask) -> None:
        for memory, fresh in zip(self._memories, self._fresh, strict=True):
            memory[:, lanes] = fresh[:, lanes]

    def declared_impedance(self, reference: Reference) -> Impedance:
        """What each law declares for its lane."""
        columns = np.split(reference.rows, len(self._laws), axis=1)
        said = [declared_by(law, Reference(rows)) for law, rows in zip(self._laws, columns, strict=True)]
        return Impedance(*(np.concatenate([getattr(one, name) for one in said], axis=2) for name in Impedance.__annotations__))

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise what the first law says that cannot serve its lane."""
        for lane, law in enumerate(self._laws):
            own = slice(lane, lane + 1)
            said: dict[str, Any] = {
                name: value[..., own] if isinstance(value, np.ndarray) else value for name, value in vars(measurement).items()
            }
            try:
                law.explain(Measurement(**said), Reference(reference.rows[:, own]))
            except ValueError as error:
                raise ValueError(f"rig {lane}: {error}") from None


def _abreast(columns: Sequence[Array]) -> Array:
    """Memories (M,) side by side; some laws remember more rows than others."""
    rows = max(map(len, columns))
    return np.stack([np.pad(one, (0, rows - len(one))) for one in columns], axis=1)
