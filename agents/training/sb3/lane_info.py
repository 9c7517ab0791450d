"""What Stable-Baselines3 is told of a lane: a dictionary as a single environment's, made of the arrays of all lanes."""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, KeysView, Mapping, ValuesView
from typing import Any

from numpy.typing import NDArray

TRUNCATED = "TimeLimit.truncated"
"""What Stable-Baselines3 calls an end that is the clock's."""


def lane_values(infos: Mapping[str, NDArray[Any]], lane: int) -> dict[str, Any]:
    """The entries of one lane, as the single environment gives them."""
    return {name: _entry(values, name, lane) for name, values in infos.items()}


def _entry(values: NDArray[Any], name: str, lane: int) -> Any:
    return bool(values[lane]) if name == "is_success" else values[lane]


class LaneInfo(dict[str, Any]):
    """``infos`` (name -> values of all lanes) of one ``lane``, whose episode goes on.

    It is filled when somebody reads all of it: few do, in each step of thousands of lanes."""

    __slots__ = ("_infos", "_lane")

    def __init__(self, infos: Mapping[str, NDArray[Any]], lane: int) -> None:
        self._infos, self._lane = infos, lane

    def __missing__(self, name: str) -> Any:
        return False if name == TRUNCATED else _entry(self._infos[name], name, self._lane)

    def get(self, name: str, default: Any = None) -> Any:
        """The entry ``name``, or ``default`` where there is none."""
        try:
            return self[name]
        except KeyError:
            return default

    def __contains__(self, name: object) -> bool:
        return name in self._infos or name == TRUNCATED or super().__contains__(name)

    def _fill(self) -> None:
        own = dict(super().items())
        super().update({**lane_values(self._infos, self._lane), TRUNCATED: False, **own})
        self._infos = {}

    def copy(self) -> dict[str, Any]:
        """A plain dictionary of all entries."""
        return dict(self.items())

    def keys(self) -> KeysView[str]:  # type: ignore[override]
        """The names of all entries."""
        self._fill()
        return super().keys()

    def values(self) -> ValuesView[Any]:  # type: ignore[override]
        """All entries."""
        self._fill()
        return super().values()

    def items(self) -> ItemsView[str, Any]:  # type: ignore[override]
        """All entries with their names."""
        self._fill()
        return super().items()

    def __iter__(self) -> Iterator[str]:
        self._fill()
        return super().__iter__()

    def __len__(self) -> int:
        self._fill()
        return super().__len__()

    def __eq__(self, other: object) -> bool:
        self._fill()
        return super().__eq__(other)

    __hash__ = None

    def __repr__(self) -> str:
        self._fill()
        return super().__repr__()

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (self.copy(),)
