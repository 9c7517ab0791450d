"""Random streams: every random part of a lane has a child seed of its own, so two controllers meet the same world.

Episode ``e`` of a lane seeded ``s`` depends on s and e alone, never on what happened in earlier episodes.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np

from birthsim_env.physics.rig.values import checked_range, length_of, shown, whole_of

F = TypeVar("F", bound=Callable[..., Any])

STREAMS = ("parameters", "reference", "user_force", "stiffness", "sensors")


def stream_key(lane_seed: int, episode: int, name: str) -> tuple[int, int]:
    """The key of one random part (one of ``STREAMS``) for one episode of one lane: two words of 64 bits.

    A seed below 2^64 is a word as it is; of a larger one a hash takes its place."""
    large = lane_seed >= 2**64
    seed = int.from_bytes(hashlib.sha256(str(lane_seed).encode()).digest()[:8], "little") if large else lane_seed
    return seed, len(STREAMS) * episode + STREAMS.index(name)


def stream(lane_seed: int, episode: int, name: str) -> np.random.Generator:
    """NumPy's generator of the stream with this ``stream_key``."""
    return np.random.Generator(np.random.Philox(key=np.array(stream_key(lane_seed, episode, name), dtype=np.uint64)))


def lane_seeds(seed: int | list[int | None] | None, num_envs: int, generator: np.random.Generator) -> list[int]:
    """One seed per lane: ``seed + i`` for an integer, the given ones for a list; missing ones come from ``generator``."""
    first = whole_of(seed)
    if first is not None:
        if first < 0:
            raise ValueError(f"seed = {shown(seed)}; allowed: None or a whole number >= 0")
        return [first + i for i in range(num_envs)]
    allowed = f"allowed: None, an integer, or one entry for each of {num_envs} lanes"
    listed = seed.ndim == 1 if isinstance(seed, np.ndarray) else isinstance(seed, Sequence)
    if seed is not None and (isinstance(seed, (str, bytes)) or not listed):
        raise ValueError(f"seed = {shown(seed)}; {allowed}")
    if seed is not None and length_of(seed) != num_envs:
        raise ValueError(f"seed has {length_of(seed):g} entries; {allowed}")
    given: list[int | None] = [None] * num_envs if seed is None else list(seed)  # type: ignore[arg-type]
    for lane, s in enumerate(given):
        number = 0 if s is None else whole_of(s)
        if number is None or number < 0:
            raise ValueError(f"seed[{lane}] = {shown(s)}; allowed: None or an integer >= 0")
    return [int(generator.integers(2**63)) if s is None else int(s) for s in given]


Range = float | tuple[float, float]
"""A fixed number, or (low, high): drawn uniformly at the start of every episode."""


def draw(value: Range, rng: np.random.Generator) -> float:
    """The number itself, or one drawn from its range."""
    if isinstance(value, tuple):
        low, high = checked_range("range", value, "SI")
        return rng.uniform(float(low), float(high))
    return float(value)


def whole(low: int, beyond: int, rng: Any) -> Any:
    """A whole number in [low, beyond), all alike but for some 2^-53, from a generator, or one per lane from ``Streams``."""
    return low + np.floor((beyond - low) * rng.uniform())


def vectorised(method: F) -> F:
    """Marks a method ``begin(lane, rng)``, ``knots(rng)`` or ``sample(time)`` of a part that serves many lanes in one call.

    It is typed as for one lane. ``begin`` and ``knots`` then also get lanes (L,) and their ``Streams``, so that what they draw
    is (L,). A part whose ``sample`` is marked has ``some(lanes)``. A user's own method is not marked, also where it takes the
    place of a marked one: it is called lane by lane, with NumPy's generator.
    """
    method.vectorised = True  # type: ignore[attr-defined]
    return method


def is_vectorised(method: Callable[..., Any]) -> bool:
    """Whether ``method`` of a part is marked by ``vectorised``."""
    return getattr(method, "vectorised", False)


def served(method: Callable[..., Any], lane: Any, rng: Any) -> Iterator[tuple[Any, Any]]:
    """The lanes and streams with which ``method`` is to be called: one lane as it is, several at once or one by one."""
    if np.ndim(lane) == 0 or is_vectorised(method):
        yield lane, rng
    else:
        yield from zip(lane.tolist(), rng.generators(), strict=True)


def put(rows: Iterable[Any], lane: Any, values: Iterable[Any]) -> None:
    """Writes a number, or one per lane, into each of ``rows`` (R, N): into one lane or lanes (L,)."""
    for row, value in zip(rows, values, strict=True):
        row[lane] = value
