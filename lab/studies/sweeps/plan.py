"""What a sweep is: its TOML file, and the points that it asks for.

``[base]`` holds what does not vary, ``[grid]`` values of which every combination is a point, ``[draw]`` ranges from which each
combination gets ``count`` points drawn at random, ``[search]`` ranges in which Optuna looks for the best point, and every
``[[map]]`` is a heat map. ``docs/sweeps.md`` has the table of names.
"""

import itertools
import math
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.metrics import UNITS
from birthsim_env.assembly import one_of
from birthsim_env.physics.rig.reading import named, read_toml
from birthsim_env.physics.rig.values import is_within, shown
from lab.studies.sweeps.names import FIXED, NAMES, check_name, check_together, check_value

DEFAULTS = {"environment": "BirthSIM/Circle-v2", "controller": "backstepping", "sensors": "ideal", "randomize": True}

MOST_POINTS = 1_000_000
"""Of a sweep, assumed: more is a mistyped number."""

LARGEST_SEED = 2**32 - 1

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
    content = read_toml("sweep", path)
    try:
        return _sweep(content)
    except ValueError as error:
        raise ValueError(f"sweep = {named(path)}: {error}") from error


def _sweep(content: dict[str, Any]) -> Sweep:
    tables = {"base": dict, "grid": dict, "draw": dict, "search": dict, "map": list}
    for name, value in content.items():
        if not isinstance(value, tables.get(name, ())):
            raise ValueError(f"{shown(name)}; allowed: [base], [grid], [draw], [search] and [[map]]")
    given = content.get("base", {})
    for name, value in given.items():
        if name not in FIXED:
            check_name(name)
            check_value(name, value)
    base = {**FIXED, **DEFAULTS, **given}
    for name, least, most in (("episodes", 1, MOST_POINTS), ("seed", 0, LARGEST_SEED)):
        _whole(f"[base] {name}", base[name], least, most)
    grid = _grid(content.get("grid", {}))
    points = _drawn(grid, content.get("draw", {}))
    search = _search(content["search"], len(points)) if "search" in content else None
    draws, ranges = content.get("draw", {}).keys() - _DRAWN.keys(), search.ranges.keys() if search else set()
    stated: set[str] = set()
    for table, names in (("base", given.keys()), ("grid", grid[0].keys()), ("draw", draws), ("search", ranges)):
        if twice := sorted(stated & names):
            raise ValueError(f"[{table}] {twice[0]} stands in another table too; allowed: once")
        stated |= names
    controllers = [one["controller"] for one in (given, *points) if "controller" in one]
    check_together(sorted(stated), set(controllers))
    varied = {*points[0], *ranges}
    return Sweep(base, points, [_map(entry, varied) for entry in content.get("map", [])], search)


def _axis(table: str, name: str, entry: Any) -> Range | list[Any]:
    """What a table gives for a name: a range, or for all but a search values."""
    check_name(name)
    if isinstance(entry, dict) and name not in NAMES:
        return _range(name, entry, table == "grid")
    if table == "search" or not isinstance(entry, list) or not entry:
        lists = "" if table == "search" else "a list of values, or for numbers "
        raise ValueError(f"[{table}] {name} = {shown(entry)}; allowed: {lists}{_form(table == 'grid')}")
    for value in entry:
        check_value(name, value)
    return entry


def _grid(table: dict[str, Any]) -> list[Point]:
    axes = {name: _axis("grid", name, entry) for name, entry in table.items()}
    if math.prod((axis.count or 1) if isinstance(axis, Range) else len(axis) for axis in axes.values()) > MOST_POINTS:
        raise ValueError(f"[grid] has more than {MOST_POINTS} points; allowed: fewer values")
    values = [axis.values() if isinstance(axis, Range) else axis for axis in axes.values()]
    return [dict(zip(axes, chosen, strict=True)) for chosen in itertools.product(*values)]


def _drawn(points: list[Point], table: dict[str, Any]) -> list[Point]:
    """``points``, each with ``count`` draws; draw k is the same whatever the count."""
    if not table:
        return points
    rest = dict(table)
    count, seed = (_whole(f"[draw] {name}", rest.pop(name, default), least) for name, (default, least) in _DRAWN.items())
    if count * len(points) > MOST_POINTS:
        raise ValueError(f"[draw] count = {count} makes {count * len(points)} points; allowed: at most {MOST_POINTS}")
    axes = {name: _axis("draw", name, entry) for name, entry in rest.items()}
    draws = []
    for number in range(count):
        places = np.random.default_rng([seed, number]).random(len(axes))
        draws.append(
            {
                name: axis.at(place) if isinstance(axis, Range) else axis[int(place * len(axis))]
                for (name, axis), place in zip(axes.items(), places, strict=True)
            }
        )
    return [{**point, **draw} for point in points for draw in draws]


def _search(table: dict[str, Any], points: int) -> Search:
    rest = dict(table)
    numbers = {name: _whole(f"[search] {name}", rest.pop(name), least) for name, least in _NUMBERS.items() if name in rest}
    words = {name: rest.pop(name) for name in _SHOWN if name in rest}
    _check_shown("[search]", words)
    ranges: dict[str, Any] = {name: _axis("search", name, entry) for name, entry in rest.items()}
    if not ranges:
        raise ValueError("[search] has no ranges; allowed: names with { from, to, log }")
    search = Search(ranges, **numbers, **words)  # type: ignore[arg-type]
    if search.trials * points > MOST_POINTS:
        raise ValueError(f"[search] trials = {search.trials} of {points} points each; allowed: at most {MOST_POINTS} together")
    return search


_DRAWN = {"count": (None, 1), "seed": (0, 0)}
_NUMBERS = {"trials": 1, "batch": 1, "seed": 0}
_SHOWN = {"metric": tuple(UNITS), "statistic": ("median", "mean", "q95", "max")}


def _check_shown(table: str, words: dict[str, Any]) -> None:
    for name, allowed in _SHOWN.items():
        if name in words:
            one_of(f"{table} {name}", words[name], allowed)


def _map(entry: Any, varied: Collection[str]) -> HeatMap:
    if not isinstance(entry, dict) or not {"x", "y"} <= set(entry) <= {"x", "y", "per", *_SHOWN}:
        raise ValueError(f"[[map]] {shown(entry)}; allowed: x, y and perhaps metric, statistic, per")
    for side in ("x", "y", "per"):
        if side in entry and not (isinstance(entry[side], str) and entry[side] in varied):
            raise ValueError(f"[[map]] {side} = {shown(entry[side])}; allowed: what varies, {', '.join(sorted(varied))}")
    _check_shown("[[map]]", entry)
    return HeatMap(**entry)


def _form(counted: bool) -> str:
    return "{ from, to, count, log }" if counted else "{ from, to, log }"


def _range(name: str, entry: dict[str, Any], counted: bool) -> Range:
    low, high, log = entry.get("from"), entry.get("to"), entry.get("log", False)
    known = {"from", "to", "log", *(("count",) if counted else ())}
    if not set(entry) <= known or not all(is_within(bound, least=-1e300, most=1e300) for bound in (low, high)):
        raise ValueError(f"{name} = {shown(entry)}; allowed: {_form(counted)}, from and to numbers")
    if not isinstance(log, bool):
        raise ValueError(f"{name} log = {shown(log)}; allowed: true, false")
    if not float(low) < float(high) or (log and low <= 0):  # type: ignore[arg-type,operator]
        raise ValueError(f"{name} = {shown(entry)}; allowed: from below to, and from above 0 with log")
    count = _whole(f"{name} count", entry.get("count"), 2, MOST_POINTS) if counted else None
    return Range(float(low), float(high), count, log)  # type: ignore[arg-type]


def _whole(name: str, value: Any, least: int, most: int = LARGEST_SEED) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise ValueError(f"{name} = {shown(value)}; allowed: a whole number from {least} to {most}")
    return value
