"""A recording: rows of numbers and what was set, in one NumPy file without pickles.

rows     (T, COLUMNS), float64: ``frames.FIELDS`` every ``EVERY`` control periods
header   JSON: format, version, rig, columns, s between rows, and events: {"row", "settings" | "path" | "lost"}
"""

from __future__ import annotations

import json
import math
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import birthsim_env
from baselines.files import whole_file
from birthsim_env.physics.lanes import Array
from birthsim_env.physics.parameters import Parameters
from birthsim_live.rig.frames import COLUMNS, FIELDS

if TYPE_CHECKING:
    from birthsim_live.rig.session import Session

FORMAT = "birthsim-recording-1"

EVERY = 4
"""Control periods between rows."""

LONGEST = 600.0
"""s, assumed: a recording ends by itself; it fills 40 MB of memory then."""

LARGEST = 2**27
"""Bytes, unpacked, that a file may claim to hold."""

EVENTS = ("settings", "path", "lost")


class Recorder:
    """Takes a session down, from now on, into memory; ``path`` is where ``save`` writes it."""

    def __init__(self, session: Session, path: Path) -> None:
        self.path = path
        self._rig, self._interval = session.rig, EVERY * session.period
        self._rows: list[Array] = []
        self._events: list[dict[str, Any]] = []
        self._known: dict[str, Any] = {}
        self._paths, self._periods = -1, 0
        self.take(session)

    @property
    def seconds(self) -> float:
        """s recorded."""
        return len(self._rows) * self._interval

    @property
    def full(self) -> bool:
        """True at ``LONGEST``: it takes no more."""
        return self.seconds >= LONGEST

    def take(self, session: Session) -> None:
        """Take note of the present control period."""
        if self._periods % EVERY == 0 and not self.full:
            self._note("settings", session.shown_settings())
            if self._paths != session.paths:
                self._paths = session.paths
                self._note("path", session.path())
            self._note("lost", session.lost)
            self._rows.append(session.row())
        self._periods += 1

    def _note(self, kind: str, value: Any) -> None:
        if kind not in self._known or self._known[kind] != value:
            self._known[kind] = value
            self._events.append({"row": len(self._rows), kind: value})

    def save(self) -> None:
        """Write the file, as a whole or not at all."""
        header = {
            "format": FORMAT,
            "birthsim": birthsim_env.__version__,
            "rig": self._rig.to_dict(),
            "columns": list(FIELDS),
            "interval": self._interval,
            "events": self._events,
        }
        with whole_file(self.path) as file:
            np.savez_compressed(file, rows=np.array(self._rows), header=np.array(json.dumps(header)))


@dataclass(frozen=True)
class Recording:
    """What a file holds: the rig, rows (T, COLUMNS) every ``interval`` s, and events in the order of their rows."""

    rig: Parameters
    rows: Array
    interval: float
    events: list[dict[str, Any]]

    @property
    def duration(self) -> float:
        """s from the first row to the last."""
        return (len(self.rows) - 1) * self.interval


def load_recording(path: str | Path) -> Recording:
    """Read a file; raises ``ValueError`` naming it and what is missing, damaged or foreign."""
    try:
        with zipfile.ZipFile(path) as archive:
            claimed = sum(entry.file_size for entry in archive.infolist())
        if claimed > LARGEST:
            raise ValueError(f"it claims {claimed} bytes; allowed: up to {LARGEST}")
        with np.load(path, allow_pickle=False) as content:
            if set(content.files) != {"rows", "header"}:
                raise ValueError(f"it holds {', '.join(content.files)}; allowed: rows and header")
            rows, header = content["rows"], json.loads(str(content["header"]))
        return _checked(rows, header)
    except OSError as error:
        raise ValueError(f"recording = {str(path)!r} cannot be read: {error.strerror or error}") from error
    except Exception as error:
        # Damage trips NumPy and zipfile in a dozen ways, tokenizer and decompressor among them.
        raise ValueError(
            f"recording = {str(path)!r} is damaged or foreign ({error}); allowed: what birthsim-live wrote"
        ) from error


def _checked(rows: Any, header: Any) -> Recording:
    if not isinstance(header, dict) or header.get("format") != FORMAT or header.get("columns") != list(FIELDS):
        found = header.get("format") if isinstance(header, dict) else header
        raise ValueError(f"format {found!r}; allowed: {FORMAT!r}")
    if rows.dtype != np.float64 or rows.ndim != 2 or rows.shape[1] != COLUMNS or len(rows) == 0:
        raise ValueError(f"rows {rows.dtype} {rows.shape}; allowed: float64 (T, {COLUMNS}), T > 0")
    interval = header["interval"]
    if not (isinstance(interval, float) and math.isfinite(interval) and 0 < interval <= 1):
        raise ValueError(f"interval {interval!r}; allowed: more than 0 and up to 1 s")
    if not isinstance(header["rig"], dict):
        raise ValueError(f"rig {header['rig']!r}; allowed: its sections")
    events, last = header["events"], 0
    for event in events:
        kinds = [kind for kind in EVENTS if kind in event]
        if len(event) != 2 or len(kinds) != 1 or not last <= event["row"] < len(rows) or not _fits(kinds[0], event[kinds[0]]):
            raise ValueError(f"event {str(event)[:80]}; allowed: a row in order, and settings, a path or lost")
        last = event["row"]
    return Recording(Parameters.from_dict(header["rig"]), rows, interval, events)


def _fits(kind: str, value: Any) -> bool:
    """Whether an event of a kind may have this value."""
    if kind == "settings":
        return isinstance(value, dict) and all(isinstance(entry, (str, float, bool)) for entry in value.values())
    if kind == "path":
        return isinstance(value, list) and bool(value) and np.array(value, dtype=np.float64).shape == (len(value), 2)
    return value is None or isinstance(value, str)
