"""A comparison in words, tables and figures as data."""

from collections.abc import Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from baselines.identification.comparing.compared import Compared, Comparison
from baselines.identification.comparing.ranking import Place
from baselines.identification.comparing.signals import Signal, Track
from baselines.tables import aligned, markdown
from birthsim_env.physics.compiled.lanes import Array

POINTS = 1000
"""Of each curve that stands in the data, at most."""


class Part(NamedTuple):
    """A table under a sentence that says what it shows."""

    says: str
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def printed(found: Comparison) -> str:
    """What a terminal shows: one rig in full, several as a ranking and a line each."""
    parts = [_ranking(found)] if len(found.rigs) > 1 else parts_of(found, found.rigs[0])
    lines = [*found.notes, *(f"{part.says}\n{aligned(part.head, part.rows)}\n" for part in parts), *verdicts(found)]
    return "\n".join(lines)


def report(found: Comparison, title: str, pictures: Sequence[str]) -> str:
    """The whole comparison as Markdown, whose last lines are those of its ``pictures``."""
    lines = [f"# {title}", "", *(f"- {line}" for line in (*found.notes, *verdicts(found))), ""]
    if len(found.rigs) > 1:
        lines += _shown(_ranking(found))
    for one in found.rigs:
        lines += [f"## {one.name}", ""]
        for part in parts_of(found, one):
            lines += _shown(part)
    return "\n".join([*lines, *pictures]) + "\n"


def _shown(part: Part) -> list[str]:
    return [f"{part.says}:", "", markdown(part.head, part.rows), ""]


def verdicts(found: Comparison) -> list[str]:
    """What the figures say, a line each."""
    lines = []
    first, *others = found.places
    for other in others:
        lines.append(_told(first, other))
    for one in found.rigs:
        lines += [f"{one.name}: {line}" for line in (_reach(one), *one.taken.full(one.rig))]
    return lines


def _told(first: Place, other: Place) -> str:
    more = f"{other.more:.3g} times the noise (95 % interval {other.low:.3g} to {other.high:.3g})"
    if other.is_worse:
        return f"{first.name} is nearer to the log than {other.name}, whose error is larger by {more}"
    return f"the log does not tell {first.name} and {other.name} apart: their errors differ by {more}"


def _reach(one: Compared) -> str:
    """When the free run leaves the log, in words."""
    run = one.free
    over = f"the free run from {run.start:.4g} to {run.end:.4g} s"
    gap = ", where openings or forces are lacking," if run.at_gap else ""
    early = min(run.leaves, key=lambda leaving: leaving.after)
    if not isfinite(early.after):
        return f"{over}{gap} stays within every limit"
    return (
        f"{over}{gap} leaves the log after {early.after:.3g} s, at {early.at:.4g} s, in {early.signal.name} "
        f"(limit {_size(early.signal, early.limit)})"
    )


def parts_of(found: Comparison, one: Compared) -> list[Part]:
    """The tables of one rig."""
    return [_windows(found, one), _free(one), *([_ahead(one)] if one.ahead else []), _worst(one), _doing(one)]


def _ranking(found: Comparison) -> Part:
    rows = []
    for place in found.places:
        one = next(rig for rig in found.rigs if rig.name == place.name)
        more = "-" if place is found.places[0] else f"{place.more:.3g} ({place.low:.3g} to {place.high:.3g})"
        every = one.doings[0]
        free = min(leaving.after for leaving in one.free.leaves)
        rows.append((place.name, f"{place.error:.3g}", more, f"{every.pressures:.3g}", f"{every.positions:.3g}", _after(free)))
    head = ("rig", "error", "more than the first, 95 % interval", "pressures", "positions", "free run leaves after")
    return Part(
        f"rigs by their error over the noise, in {len(found.rigs[0].scores)} windows of {found.window:.3g} s, each begun anew",
        head,
        rows,
    )


def _windows(found: Comparison, one: Compared) -> Part:
    rows = [
        (
            error.signal.name,
            _size(error.signal, error.rms),
            f"{_size(error.signal, error.largest)} at {error.at:.4g} s",
            f"{100 * error.share:.3g} %",
            f"{error.over_noise:.3g}",
        )
        for error in one.errors
    ]
    says = f"{one.name} in {len(one.scores)} windows of {found.window:.3g} s, each begun anew in the state that fits it best"
    return Part(says, ("signal", "RMS error", "largest", "RMS of the log's motion", "RMS over noise"), rows)


def _free(one: Compared) -> Part:
    rows = []
    for error, leaving in zip(one.free.errors, one.free.leaves, strict=True):
        left = f"{leaving.at:.4g} s, after {leaving.after:.3g} s" if isfinite(leaving.after) else "never"
        rows.append(
            (
                error.signal.name,
                _size(error.signal, leaving.limit),
                left,
                _size(error.signal, error.rms),
                f"{_size(error.signal, error.largest)} at {error.at:.4g} s",
                f"{100 * error.share:.3g} %",
            )
        )
    ends = ", where openings or forces are lacking" if one.free.at_gap else ""
    return Part(
        f"{one.name} in free run from {one.free.start:.4g} to {one.free.end:.4g} s{ends}: "
        "only openings and forces enter, so that positions drift",
        ("signal", "limit", "leaves it at", "RMS error", "largest", "RMS of the log's motion"),
        rows,
    )


def _ahead(one: Compared) -> Part:
    rows = [(here.signal.name, _size(here.signal, here.limit), *map(_time, here.after)) for here in one.ahead]
    first = one.ahead[0]
    return Part(
        f"how far ahead {one.name} predicts: time in free run within the limit, of {first.runs} runs that begin all over the "
        f"log and are followed for {first.horizon:.3g} s",
        ("signal", "limit", "10 % of runs", "half", "90 %"),
        [(name, limit, *(f"> {first.horizon:.3g} s" if one == "-" else one for one in after)) for name, limit, *after in rows],
    )


def _worst(one: Compared) -> Part:
    always = _always(one)
    rows = [
        (
            f"{window.start:.4g} to {window.end:.4g} s",
            f"{window.over_noise:.3g}",
            f"{window.signal.name}, {_size(window.signal, window.rms)}",
            ", ".join(name for name in window.does if name not in always) or "-",
        )
        for window in one.worst
    ]
    head = ("time", "error over noise", "most of it in, RMS", "what the rig does")
    return Part(f"the worst windows of {one.name}", head, rows)


def _doing(one: Compared) -> Part:
    always = _always(one)
    rows = [
        (does.what, str(does.count), f"{does.pressures:.3g}", f"{does.positions:.3g}")
        for k, does in enumerate(one.doings)
        if k == 0 or does.what not in always
    ]
    says = f"the error of {one.name} over the noise by what the rig does in a window"
    return Part(says, ("windows", "number", "pressures", "positions"), rows)


def _always(one: Compared) -> set[str]:
    """What the rig does in every window, which tells nothing of any."""
    return {does.what for does in one.doings if does.count == one.doings[0].count}


def _size(signal: Signal, value: float) -> str:
    """A size with three digits, and no power of ten below 1 MPa."""
    return f"{float(f'{value:.3g}'):g} Pa" if signal.unit == "Pa" else f"{1e3 * value:.3g} mm"


def _time(value: float) -> str:
    return f"{value:.3g} s" if isfinite(value) else "-"


def _after(value: float) -> str:
    return f"{value:.3g} s" if isfinite(value) else "never"


def data_of(found: Comparison, title: str) -> dict[str, Any]:
    """The comparison as JSON: every figure of the tables, and the curves of the pictures; null for what never happens."""
    return {
        "log": title,
        "window": found.window,
        "notes": list(found.notes),
        "signals": {s.name: {**_fields(s), "limit": found.limits[s.name]} for s in found.signals},
        "ranking": [{**_fields(place), "is_worse": place.is_worse} for place in found.places],
        "rigs": [_data(one) for one in found.rigs],
    }


def _data(one: Compared) -> dict[str, Any]:
    free, taken = one.free, one.taken
    return {
        "name": one.name,
        "parameters": one.rig.to_dict(),
        "error": one.error,
        "taken": {
            "biases": taken.biases.tolist(),
            "zeros": taken.zeros.tolist(),
            "distortion": taken.distortion,
            "late": taken.late,
        },
        "windows": {
            "starts": one.starts.tolist(),
            "error_over_noise": np.sqrt(one.scores).tolist(),
            "errors": [_named(error) | {"share": error.share, "over_noise": error.over_noise} for error in one.errors],
            "rms": {track.signal.name: track.off.tolist() for track in one.tracks},
        },
        "worst": [_named(window) for window in one.worst],
        "doings": [_fields(does) for does in one.doings],
        "free_run": {
            "start": free.start,
            "end": free.end,
            "at_gap": free.at_gap,
            "errors": [_named(error) | {"share": error.share} for error in free.errors],
            "leaves": [_named(leaving) for leaving in free.leaves],
            "curves": {track.signal.name: _curve(track) for track in free.tracks},
        },
        "ahead": [_named(here) for here in one.ahead],
    }


def _fields(record: Any) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in vars(record).items()}


def _named(record: Any) -> dict[str, Any]:
    """The fields of a record of a signal, which is called by its name."""
    return _fields(record) | {"signal": record.signal.name}


def _curve(track: Track) -> dict[str, list[float]]:
    times, measured, error = curve_of(track, POINTS)
    return {"time": times.tolist(), "measured": measured.tolist(), "error": error.tolist()}


def curve_of(track: Track, points: int) -> tuple[Array, Array, Array]:
    """Times, s, what was measured, and the error, of a track of one window: at most so many evenly chosen samples."""
    known = np.flatnonzero(np.isfinite(track.measured[0]))
    some = known[:: max(1, -(-len(known) // points))]
    return track.times[0, some], track.measured[0, some], track.error[0, some]
