"""A part that draws from other ranges takes the place of one whose episodes go on."""

import copy
from typing import Any

import numpy as np

from birthsim_env.physics.rig.values import plain
from birthsim_env.restored import is_own


def prepare(part: Any, lanes: int) -> None:
    """Make room in a trajectory, a hand or a stiffness schedule for ``lanes`` lanes."""
    if is_own(type(part)):
        vars(part).update({name: plain(value) for name, value in vars(part).items()})
    part.prepare(lanes)


def emptied(part: Any, lanes: int) -> Any:
    """A trajectory, a hand or a stiffness schedule as it was when no lane had begun."""
    empty = copy.copy(part)
    empty.prepare(lanes)
    return empty


def take_over(part: Any, empty: Any, successor: Any) -> bool:
    """Let a ``successor`` in which no lane has begun go on with the lanes of a ``part``, and draw only where one begins anew.

    ``empty`` is the part as it was when no lane had begun. False where the successor cannot, and stays as it is: where it does
    anything else than that part but draw, which shows before any lane begins, or where either is a user's own.
    """
    if not (is_own(type(part)) and is_own(type(successor))):
        return False
    before, after = _arrays(empty), _arrays(successor)
    if before.keys() != after.keys() or not all(np.array_equal(before[name], after[name]) for name in before):
        return False
    if _manner(empty) != _manner(successor):
        return False
    vars(successor).update({name: vars(part)[name] for name in before})
    return True


def _arrays(part: Any) -> dict[str, Any]:
    """Room for lanes, and what the same stage looks up for all of them."""
    return {name: value for name, value in vars(part).items() if isinstance(value, np.ndarray)}


def _manner(part: Any) -> tuple[Any, ...]:
    """What a stage does with the room that it has; of a hand also what else the loop asks it."""
    stage = part.stage()
    of_hand = (part.closed_loop, part.jump_rate) if hasattr(part, "jump_rate") else ()
    return (part if stage is None else (stage.function, stage.constants.tobytes()), *of_hand)
