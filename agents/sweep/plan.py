"""What a sweep is: its TOML file, and the points that it asks for.

``[base]`` holds what does not vary, ``[grid]`` values of which every combination is a point, ``[draw]`` ranges from which each
combination gets ``count`` points drawn at random, ``[search]`` ranges in which Optuna looks for the best point, and every
``[[map]]`` is a heat map. ``docs/sweeps.md`` has the table of names.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

NAMES = ("environment", "controller", "policy", "sensors", "randomize", "reference", "user_force", "train")
"""What may vary as a whole."""

GROUPS = {
    "rig": "a parameter of the rig as it is",
    "believed": "one of the rig as its controller believes it, and as it is unless [rig] says otherwise",
    "gain": "an option of the controller",
    "training": "a setting of the training",
    "residual": "what the residual may do",
}
"""First part of a dotted name -> what the rest is."""

FIXED = {"episodes": 32, "seed": 0, "parameters": None}
"""What only [base] may have, and its default: episodes a point, the seed of the first, and a TOML file of the believed rig."""

DEFAULTS = {"environment": "BirthSIM/Circle-v1", "controller": "backstepping", "sensors": "ideal", "randomize": True}

MOST_POINTS = 1_000_000
"""Of a sweep, assumed: more is a mistyped number."""

Point = dict[str, Any]
"""Name -> value, of all that varies."""


@dataclass(frozen=True)
class Range:
    """From ``low`` to ``high``, evenly or with ``log`` by equal factors; ``count`` values of it in a grid."""

    low: float
    high: float
    count: int | None = None
    log: bool = False

    def values(self) -> list[float]:
        """``count`` of them."""
        spread = np.geomspace if self.log else np.linspace
        return [float(value) for value in spread(self.low, self.high, self.count or 1)]

    def at(self, place: float) -> float:
        """The value at a ``place`` from 0 to 1."""
        if self.log:
            return float(self.low * (self.high / self.low) ** place)
        return float(self.low + place * (self.high - self.low))


@dataclass(frozen=True)
class HeatMap:
    """A picture of a ``metric``'s ``statistic`` over ``x`` and ``y``, one panel per value of ``per``."""

    x: str
    y: str
    metric: str = "settled_rms"
    statistic: str = "median"
    per: str | None = None


@dataclass(frozen=True)
class Search:
    """``trials`` in batches of ``batch``, each proposed from all batches before it; the least ``statistic`` of ``metric`` is
    the best, over all episodes of all points."""

    ranges: dict[str, Range]
    trials: int = 64
    batch: int = 8
    seed: int = 0
    metric: str = "settled_rms"
    statistic: str = "q95"


@dataclass(frozen=True)
class Sweep:
    """A file's content; ``points`` are those of grid and draws."""

    base: dict[str, Any]
    points: list[Point]
    maps: list[HeatMap] = field(default_factory=list)
    search: Search | None = None


def load_sweep(path: Path) -> Sweep:
    """The sweep in a TOML file; ``ValueError`` names the file and what in it cannot be."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(f"sweep {str(path)!r} is no file; allowed: a TOML file") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"sweep {str(path)!r} is no TOML: {error}") from error
    try:
        return _sweep(content)
    except ValueError as error:
        raise ValueError(f"sweep {str(path)!r}: {error}") from error


def _sweep(content: dict[str, Any]) -> Sweep:
    tables = {"base": dict, "grid": dict, "draw": dict, "search": dict, "map": list}
    for name, value in content.items():
        if not isinstance(value, tables.get(name, ())):
            raise ValueError(f"{name!r}; allowed: [base], [grid], [draw], [search] and [[map]]")
    given = content.get("base", {})
    for name in given:
        if name not in FIXED:
            _check_name(name)
    base = {**FIXED, **DEFAULTS, **given}
    for name, least in (("episodes", 1), ("seed", 0)):
        _whole(f"[base] {name}", base[name], least)
    points = _drawn(_grid(content.get("grid", {})), content.get("draw", {}))
    search = _search(content["search"]) if "search" in content else None
    varied = {*points[0], *(search.ranges if search else ())}
    return Sweep(base, points, [_map(entry, varied) for entry in content.get("map", [])], search)


def _grid(table: dict[str, Any]) -> list[Point]:
    axes = {}
    for name, entry in table.items():
        _check_name(name)
        axes[name] = _range(name, entry, True).values() if isinstance(entry, dict) else entry
        if not isinstance(axes[name], list) or not axes[name]:
            raise ValueError(f"[grid] {name} = {entry!r}; allowed: a list of values, or {{ from, to, count, log }}")
    if math.prod(len(values) for values in axes.values()) > MOST_POINTS:
        raise ValueError(f"[grid] has more than {MOST_POINTS} points; allowed: fewer values")
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def _drawn(points: list[Point], table: dict[str, Any]) -> list[Point]:
    """``points``, each with ``count`` draws; draw k is the same whatever the count."""
    if not table:
        return points
    rest = dict(table)
    count, seed = _whole("[draw] count", rest.pop("count", None), 1), _whole("[draw] seed", rest.pop("seed", 0), 0)
    if count * len(points) > MOST_POINTS:
        raise ValueError(f"[draw] count = {count} makes {count * len(points)} points; allowed: at most {MOST_POINTS}")
    axes: dict[str, Range | list[Any]] = {}
    for name, entry in rest.items():
        _check_name(name)
        axes[name] = _range(name, entry, False) if isinstance(entry, dict) else entry
        if isinstance(entry, list) and entry:
            continue
        if not isinstance(entry, dict):
            raise ValueError(f"[draw] {name} = {entry!r}; allowed: a list to choose from, or {{ from, to, log }}")
    draws = []
    for number in range(count):
        places = np.random.default_rng([seed, number]).random(len(axes))
        draws.append({
            name: axis.at(place) if isinstance(axis, Range) else axis[int(place * len(axis))]
            for (name, axis), place in zip(axes.items(), places, strict=True)
        })  # fmt: skip
    return [{**point, **draw} for point in points for draw in draws]


def _search(table: dict[str, Any]) -> Search:
    rest = dict(table)
    numbers = {name: _whole(f"[search] {name}", rest.pop(name), least) for name, least in _NUMBERS.items() if name in rest}
    words = {name: str(rest.pop(name)) for name in ("metric", "statistic") if name in rest}
    ranges = {}
    for name, entry in rest.items():
        _check_name(name)
        if not isinstance(entry, dict):
            raise ValueError(f"[search] {name} = {entry!r}; allowed: {{ from, to, log }}")
        ranges[name] = _range(name, entry, False)
    if not ranges:
        raise ValueError("[search] has no ranges; allowed: names with { from, to, log }")
    return Search(ranges, **numbers, **words)  # type: ignore[arg-type]


_NUMBERS = {"trials": 1, "batch": 1, "seed": 0}


def _map(entry: Any, varied: Sequence[str] | set[str]) -> HeatMap:
    known = {"x", "y", "metric", "statistic", "per"}
    if not isinstance(entry, dict) or not {"x", "y"} <= set(entry) <= known:
        raise ValueError(f"[[map]] {entry!r}; allowed: x, y and perhaps metric, statistic, per")
    for side in ("x", "y", "per"):
        if side in entry and entry[side] not in varied:
            raise ValueError(f"[[map]] {side} = {entry[side]!r}; allowed: what varies, {', '.join(sorted(varied))}")
    return HeatMap(**entry)


def _check_name(name: str) -> None:
    group, dot, rest = name.partition(".")
    if name not in NAMES and not (group in GROUPS and dot and rest):
        groups = ", ".join(f'"{group}.NAME"' for group in GROUPS)
        raise ValueError(f"{name!r}; allowed: {', '.join(NAMES)}, {groups}; in [base] also {', '.join(FIXED)}")


def _range(name: str, entry: dict[str, Any], counted: bool) -> Range:
    allowed = "{ from, to, count, log }" if counted else "{ from, to, log }"
    numbers = [entry.get("from"), entry.get("to")]
    if not set(entry) <= {"from", "to", "log", *(("count",) if counted else ())} or not all(map(_is_number, numbers)):
        raise ValueError(f"{name} = {entry!r}; allowed: {allowed}")
    low, high = float(numbers[0]), float(numbers[1])  # type: ignore[arg-type]
    if not low < high or (entry.get("log") and low <= 0):
        raise ValueError(f"{name} = {entry!r}; allowed: from below to, and from above 0 with log")
    count = _whole(f"{name} count", entry.get("count"), 2, MOST_POINTS) if counted else None
    return Range(low, high, count, bool(entry.get("log", False)))


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300


def _whole(name: str, value: Any, least: int, most: int = 2**32 - 1) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise ValueError(f"{name} = {value!r}; allowed: a whole number from {least} to {most}")
    return value
