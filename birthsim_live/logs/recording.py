"""A recording: rows of numbers and what was set, in one file of chunks, each readable without those that follow.

A chunk is its length and the CRC-32 of its content, four bytes each, little-endian, and then its content, compressed by zlib:
a line of JSON, and rows of float64 to the end: (T, 2 COLUMNS), first the rig, then the one beside it, NaN while there is none.
Files of format 2 have one rig.

first chunk   {"format", "birthsim", "rig", "columns", "interval"}: version, rig, names as in ``FIELDS``, s between rows
others        {"events"}: those of its rows, {"row", "settings" | "path" | "lost" | "second_lost"}, the row counted from the
              file's first

A process that is killed leaves whole chunks, and perhaps a part of one at the end, which readers leave out.
"""

import json
import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.json_reading import parse_json
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.reading import named, read
from birthsim_env.physics.rig.schema import Listed
from birthsim_env.physics.rig.values import problem

FIELDS = {
    "time": 1, "episode_time": 1, "joints": 2, "position": 2, "velocity": 2, "target": 2, "compliant": 2, "scenario_force": 2,
    "drag_force": 2, "pointer": 2, "pressures": 4, "openings": 4, "stiffness": 2, "pneumatic": 2, "pneumatic_setpoint": 2,
    "friction": 2, "flows": 4,
}  # fmt: skip
"""What a row holds of a rig: name -> how many numbers, SI units; a pointer that is not there is NaN."""

COLUMNS = sum(FIELDS.values())
_ENDS = list(accumulate(FIELDS.values()))
SLICES = {name: slice(end - size, end) for (name, size), end in zip(FIELDS.items(), _ENDS, strict=True)}

EVERY = 4
"""Control periods between rows."""

FORMAT = "birthsim-recording-3"

RIGS = {"birthsim-recording-2": 1, FORMAT: 2}
"""Format -> how many rigs a row holds."""

SUFFIX = ".rec"

LARGEST = 2**27
"""Bytes that a file may have, and may hold unpacked."""

WORDS, BRACKETS, CHUNKS = 2**24, 2**20, 2**17
"""Of JSON that a file may hold: bytes, and lists and objects, each of which takes many times its bytes in memory; and chunks.
A minute with a slider that never rests is 2 MB, ten minutes at a twentieth of real time are 24,000 chunks."""

EVENTS = ("settings", "path", "lost", "second_lost")

FIRST_COLUMNS = list(FIELDS)[: list(FIELDS).index("friction")]
"""What older files hold; they play with NaN in place of the rest."""

_CHUNK = {"events": Listed(dict)}
_HEAD = struct.Struct("<II")


@dataclass(frozen=True)
class Recording:
    """What a file holds: the rig, rows (T, COLUMNS) every ``interval`` s, events in the order of their rows, and the rows of
    the rig beside it (T, COLUMNS), NaN where there is none."""

    rig: Parameters
    rows: Array
    interval: float
    events: list[dict[str, Any]]
    second: Array

    @property
    def duration(self) -> float:
        """s from the first row to the last."""
        return (len(self.rows) - 1) * self.interval


def packed(said: dict[str, Any], rows: Array | None = None) -> bytes:
    """A chunk that says ``said`` and holds ``rows`` (T, 2 COLUMNS)."""
    content = json.dumps(said).encode() + b"\n" + (b"" if rows is None else rows.astype("<f8").tobytes())
    content = zlib.compress(content, 1)
    return _HEAD.pack(len(content), zlib.crc32(content)) + content


def load_recording(path: str | Path) -> Recording:
    """Read a file; raises ``ValueError`` naming it and what is missing, damaged or foreign."""
    content = read("recording", path, LARGEST)
    try:
        chunks = list(_unpacked(content))
        if not chunks:
            raise ValueError("no chunk is whole")
        header = chunks[0][0]
        events = [event for said, _ in chunks[1:] for event in said["events"]]
        return _checked(np.concatenate([numbers for _, numbers in chunks]), header, events)
    except Exception as error:
        # Damage trips struct, zlib and NumPy in a dozen ways.
        raise ValueError(
            f"recording = {named(path)} is damaged or foreign ({problem(error)}); allowed: what birthsim live wrote"
        ) from error


def _unpacked(content: bytes) -> Iterator[tuple[Any, Array]]:
    """What the chunks say, and the numbers of their rows; the last one is left out where it is not whole."""
    place, claimed, chunks, words, brackets = 0, 0, 0, 0, 0
    while place + _HEAD.size <= len(content):
        length, digest = _HEAD.unpack_from(content, place)
        begin, place = place + _HEAD.size, place + _HEAD.size + length
        chunk = content[begin:place]
        if len(chunk) < length or zlib.crc32(chunk) != digest:
            if place < len(content):
                raise ValueError(f"the chunk at byte {begin - _HEAD.size} has another checksum")
            return
        unpack = zlib.decompressobj()
        raw = unpack.decompress(chunk, LARGEST - claimed + 1)
        claimed += len(raw)
        if claimed > LARGEST:
            raise ValueError(f"it holds more than {LARGEST} bytes; allowed: up to {LARGEST}")
        said, _, rows = raw.partition(b"\n")
        chunks, words, brackets = chunks + 1, words + len(said), brackets + said.count(b"[") + said.count(b"{")
        for name, count, most in (
            ("chunks", chunks, CHUNKS),
            ("bytes of JSON", words, WORDS),
            ("brackets", brackets, BRACKETS),
        ):
            if count > most:
                raise ValueError(f"it holds more than {most} {name}; allowed: up to {most}")
        yield parse_json("a chunk", said, _CHUNK if chunks > 1 else dict), np.frombuffer(rows, dtype="<f8").astype(np.float64)


def _checked(numbers: Array, header: Any, events: list[Any]) -> Recording:
    columns = header.get("columns") if isinstance(header, dict) else None
    if columns not in (list(FIELDS), FIRST_COLUMNS) or header.get("format") not in RIGS:
        found = header.get("format") if isinstance(header, dict) else header
        raise ValueError(f"format {found!r}; allowed: {', '.join(map(repr, RIGS))}")
    rigs, held = RIGS[header["format"]], sum(FIELDS[name] for name in columns)
    several = numbers.reshape(-1, rigs, held)
    rows, second = np.full((2, len(several), COLUMNS), math.nan)
    rows[:, :held] = several[:, 0]
    second[:, :held] = several[:, 1] if rigs == 2 else math.nan
    if len(rows) == 0:
        raise ValueError("no rows; allowed: at least one")
    interval = header["interval"]
    if not (isinstance(interval, float) and math.isfinite(interval) and 0 < interval <= 1):
        raise ValueError(f"interval {interval!r}; allowed: more than 0 and up to 1 s")
    if not isinstance(header["rig"], dict):
        raise ValueError(f"rig {header['rig']!r}; allowed: its sections")
    last = 0
    for event in events:
        kinds = [kind for kind in EVENTS if kind in event]
        if len(event) != 2 or len(kinds) != 1 or not last <= event["row"] < len(rows) or not _fits(kinds[0], event[kinds[0]]):
            raise ValueError(f"event {str(event)[:80]}; allowed: a row in order, and {', '.join(EVENTS)}")
        last = event["row"]
    return Recording(Parameters.from_dict(header["rig"]), rows, interval, events, second)


def _fits(kind: str, value: Any) -> bool:
    """Whether an event of a kind may have this value."""
    if kind == "settings":
        return isinstance(value, dict) and all(isinstance(entry, (str, int, float)) for entry in value.values())
    if kind == "path":
        return isinstance(value, list) and bool(value) and np.array(value, dtype=np.float64).shape == (len(value), 2)
    return value is None or isinstance(value, str)
