"""Rows with names: one declaration says where each quantity stands in an array, its unit and what it is.

    class Jump(Rows):
        force = rows("x y", "N", "force of the hand a period ago")
        since = row("s", "since it jumped")

Rows are numbered as they are written: ``Jump.size`` is 3, ``Jump.since.first`` 2. ``Jump(array)`` names the rows of an array
(3, N): ``.force`` is a view (2, N), ``.since`` (N,), ``.rows`` the array. Kernels write the same, and take what Python named.
A stage of a closed loop says in its annotations of which layouts it is handed blocks (``loop.stage``); a block's views have a
constant shape. ``Numbers`` are the same for all lanes, and ``number`` is one of them.
"""

import copy
from collections.abc import Iterator
from typing import Any, ClassVar, Generic, Self, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled.named import Named

Array = NDArray[np.float64]
V = TypeVar("V")


class Group(Generic[V]):
    """``count`` rows under one name, from ``first`` on.

    Where they differ they have ``names`` and ``units``, one each, else one unit. A ``single`` row has no axis of its own.
    ``layout`` is that of a part, else None.
    """

    def __init__(
        self,
        count: int,
        units: tuple[str, ...],
        about: str,
        names: tuple[str, ...] = (),
        layout: "type[Rows] | None" = None,
        single: bool = False,
    ) -> None:
        self.count, self.units, self.about, self.names, self.layout, self.single = count, units, about, names, layout, single
        self.first = 0

    @property
    def place(self) -> slice:
        """The rows in an array of the layout that has this group; all that follow where this is of no fixed size."""
        open_ended = self.layout.open_ended if self.layout else not self.count
        return slice(self.first, None if open_ended else self.first + self.count)

    @overload
    def __get__(self, record: None, layout: "type[Rows]") -> Self: ...

    @overload
    def __get__(self, record: "Rows", layout: "type[Rows]") -> V: ...

    def __get__(self, record: "Rows | None", layout: "type[Rows]") -> Any:
        if record is None:
            return self
        own = record.rows[self.first if self.single else self.place]
        return self.layout(own) if self.layout else own


L = TypeVar("L", bound="Rows")


def row(unit: str, about: str, name: str = "") -> Group[Array]:
    """One row, (N,); ``name`` where others know it by another one."""
    return Group(1, (unit,), about, (name,) if name else (), single=True)


def rows(names: str | int, unit: str | tuple[str, ...], about: str) -> Group[Array]:
    """Rows side by side, (M, N): their names, with spaces between, or how many; one unit, or theirs. The last group of a layout
    may have 0 rows: it takes what is left of an array."""
    units = (unit,) if isinstance(unit, str) else unit
    return Group(names, units, about) if isinstance(names, int) else Group(len(names.split()), units, about, (*names.split(),))


def number(unit: str, about: str) -> Group[float]:
    """One number, the same for all lanes."""
    return Group(1, (unit,), about, single=True)


def part(layout: type[L], about: str, prefix: str | None = None) -> Group[L]:
    """The rows of another layout. Others know them by names that begin with ``prefix``, or with the name of the part."""
    return Group(layout.size, (), about, () if prefix is None else (prefix,), layout)


class Rows(Named):
    """A layout, and with an array its rows by name. ``ValueError`` for an array that has not ``size`` rows.

    A layout that derives from others has their groups first. ``open_ended`` is True where its last one takes what is
    left of an array.
    """

    __slots__ = ()
    rows: Array
    groups: ClassVar[dict[str, Group[Any]]] = {}
    size: ClassVar[int] = 0
    open_ended: ClassVar[bool] = False
    per_lane: ClassVar[bool] = True

    def __init_subclass__(cls) -> None:
        bases = {name: copy.copy(group) for base in cls.__bases__ for name, group in getattr(base, "groups", {}).items()}
        own = {name: group for name, group in vars(cls).items() if isinstance(group, Group)}
        cls.groups, cls.size, cls.open_ended = {**bases, **own}, 0, False
        for name, group in cls.groups.items():
            if name in dir(Rows):
                raise TypeError(f"{cls.__name__}.{name}; allowed: other names than those of ``Rows`` itself")
            if cls.open_ended:
                raise TypeError(f"{cls.__name__}.{name} follows a group without a size; allowed: that group is the last")
            group.first = cls.size
            cls.size += group.count
            cls.open_ended = group.place.stop is None
            setattr(cls, name, group)

    def __init__(self, rows: Array) -> None:
        found, size = rows.shape[0], type(self).size
        if found != size and not (self.open_ended and found > size):
            more = " or more" if self.open_ended else ""
            raise ValueError(f"rows of {type(self).__name__} have shape {rows.shape}; allowed: {size}{more} rows")
        self.rows = rows

    @classmethod
    def entries(cls, prefix: str = "") -> Iterator[tuple[str, str, str, int]]:
        """Name, unit, meaning and number of rows of all entries in order, those of a part behind its name."""
        for name, group in cls.groups.items():
            if group.layout:
                inner = group.layout.entries(prefix + (group.names[0] if group.names else f"{name}_"))
                yield from ((own, unit, f"{group.about}: {about}", count) for own, unit, about, count in inner)
            elif group.names:
                units = group.units * (1 if len(group.units) > 1 else group.count)
                yield from ((prefix + own, unit, group.about, 1) for own, unit in zip(group.names, units, strict=True))
            else:
                yield prefix + name, group.units[0], group.about, group.count

    @classmethod
    def lane(cls, **values: Any) -> Array:
        """The rows (M,) of one lane: what is named has these values, all else is zero."""
        unknown = values.keys() - cls.groups.keys()
        if unknown:
            raise TypeError(f"{cls.__name__} of {', '.join(unknown)}; allowed: {', '.join(cls.groups)}")
        rows = [
            np.broadcast_to(values.get(name, 0.0), group.count)
            if group.place.stop
            else np.asarray(values.get(name, np.zeros(group.count)))
            for name, group in cls.groups.items()
        ]
        return np.concatenate(rows, dtype=np.float64)


class Numbers(Rows):
    """A layout of numbers that are the same for all lanes, as the constants of a stage are."""

    __slots__ = ()
    per_lane = False

    @classmethod
    def numbers(cls, **values: Any) -> Array:
        """The numbers (M,); ``TypeError`` where one is not given, or not known."""
        if values.keys() != cls.groups.keys():
            raise TypeError(f"{cls.__name__} of {', '.join(values)}; allowed: {', '.join(cls.groups)}")
        return cls.lane(**values)
