"""A log of some seconds, and what sensors, cables, loggers and hands do to its columns."""

from collections.abc import Callable

import numpy as np

from baselines.identification.log.trial import Trial
from birthsim_env.physics.compiled.lanes import Array
from tests.identification.trials import part, trial

Columns = dict[str, Array]
Change = Callable[[Columns], object]

SIGNALS = ("times", "openings", "pressures", "positions", "forces")
ROWS = 3000


def columns() -> Columns:
    """Those of a good log, to be changed."""
    short = part(trial(), 0, ROWS)
    return {name: getattr(short, name).copy() for name in SIGNALS}


ALL = slice(None)


def put(signal: str, rows: int | slice | list[int], value: float | tuple[float, float], axis: int | slice = ALL) -> Change:
    """A value in some rows of a signal, or a pair in both of its axes."""
    numbers = np.reshape(value, (-1, 1)) if isinstance(value, tuple) else value
    where = np.atleast_1d(np.arange(ROWS)[rows])

    def change(log: Columns) -> None:
        if log[signal].ndim == 1:
            log[signal][where] = numbers
        else:
            log[signal][axis if isinstance(axis, slice) else [axis], where] = numbers

    return change


def times(signal: str, factor: float, more: float = 0.0, axis: int | slice = ALL) -> Change:
    """A signal in another unit."""
    return lambda log: np.copyto(log[signal][axis], factor * log[signal][axis] + more)


def exchanged(signal: str, one: int, other: int) -> Change:
    """Two columns of a signal, each in the place of the other."""

    def change(log: Columns) -> None:
        log[signal][[one, other]] = log[signal][[other, one]]

    return change


def without(rows: list[int] | slice) -> Change:
    """A log that lacks some rows."""
    return lambda log: log.update({name: np.delete(log[name], rows, axis=-1) for name in SIGNALS})


def doubled(row: int) -> Change:
    """A log that has a row twice."""
    return lambda log: log.update({name: np.insert(log[name], row, log[name][..., row], axis=-1) for name in SIGNALS})


def stuck(signal: str, first: int, last: int, axis: int | slice = ALL) -> Change:
    """A sensor that shows what it showed at row ``first``."""
    return lambda log: np.copyto(log[signal][axis, ..., first:last], log[signal][axis, ..., first : first + 1])


def hung(first: int, last: int) -> Change:
    """A logger that writes row ``first`` again and again."""
    return lambda log: [log[name].__setitem__((ALL, slice(first, last)), log[name][:, [first]]) for name in SIGNALS[1:4]]


def shifted(signal: str, first: int, last: int, size: float) -> Change:
    """A first axis that is off by ``size`` for some rows."""

    def change(log: Columns) -> None:
        log[signal][0, first:last] += size

    return change


def capped(signal: str, share: float) -> Change:
    """Sensors that show each axis up to what a share of its rows stays below."""
    return lambda log: np.minimum(log[signal], np.quantile(log[signal], share, axis=1, keepdims=True), out=log[signal])


def scattered(signal: str, share: float, size: float) -> Change:
    """A share of a signal's numbers that are off by some ``size``."""

    def change(log: Columns) -> None:
        rng = np.random.default_rng(4)
        hit = rng.random(log[signal].shape) < share
        log[signal][hit] += size * rng.normal(size=int(hit.sum()))

    return change


def changed(*changes: Change) -> Trial:
    """The log, changed, as it was read."""
    log = columns()
    for change in changes:
        change(log)
    return Trial(*(log[name] for name in SIGNALS))
