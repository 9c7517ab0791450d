"""Loops as data: position-independent images, which the compiled ``birthsim_advance`` runs.

An image is a row of 64-bit words: a head, the rows of ``layout``, and parts one behind the other. A part is a head, entries of
its stages, places where an address has to be put, and their memory, constants and tables. It counts its words from its own
beginning, so that whoever has an image may copy it, and exchange one part for another.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_build.layout import FIRST, ROWS
from birthsim_env.gradients.traced import Adjoint
from birthsim_env.loop.rows import SEEN, WORLD
from birthsim_env.loop.stage import TABLE, Stage
from birthsim_env.physics.compiled.lanes import Array

Words = NDArray[np.int64]

MAGIC = 0x32_6D_69_73_68_74_72_69
"""First word of an image: the version of this format, "irthsim2"."""
HEAD, PART_HEAD, ENTRY = 8, 4, 4
"""Words of an image's head (magic, words in all, parts, rows), of a part's (words in all, stages, addresses) and of an entry
(number of the function; words at which memory, constants and the description of tables begin)."""

LEFT_OUT = 4
"""Word of the head whose bit p is 1 where part p is left out."""

OF_INPUTS = -1
"""Instead of where its memory begins: the memory of this stage are the inputs."""


@dataclass(frozen=True)
class Part:
    """Stages of one lane that belong together; ``rows`` of ``layout`` have these values where the part begins."""

    stages: tuple[Stage, ...]
    rows: Mapping[int, float]


def function_name(stage: Stage | Adjoint) -> str:
    """Where the function of a stage, or of its adjoint, is, as ``module:name``."""
    return name_of(stage.function)


def name_of(function: Any) -> str:
    """Where a kernel is, as ``module:name``."""
    plain = getattr(function, "py_func", function)
    return f"{plain.__module__}:{plain.__qualname__}"


def packed_part(part: Part, functions: Sequence[str]) -> Words:
    """A part as words; ``functions`` are the names of the functions of the code, in order."""
    entries = [[functions.index(function_name(stage)), 0, 0, 0] for stage in part.stages]
    tables = sum(len(stage.tables) for stage in part.stages)
    place = PART_HEAD + ENTRY * len(entries) + 2 * tables
    addresses: list[tuple[int, int]] = []
    pieces: list[Words] = []

    def put(array: NDArray[Any]) -> int:
        nonlocal place
        content = np.ascontiguousarray(array).tobytes()
        words = np.frombuffer(content + bytes(-len(content) % 8), dtype=np.int64)
        pieces.append(words)
        place += len(words)
        return place - len(words)

    for entry, stage in zip(entries, part.stages, strict=True):
        entry[1] = OF_INPUTS if stage.memory is INPUT_MEMORY else put(np.zeros(0) if stage.memory is None else stage.memory)
        entry[2] = put(stage.constants)
        kept = [(put(table), table.shape) for table in stage.tables]
        about = np.zeros((len(kept), TABLE), dtype=np.int64)
        for row, (_, shape) in zip(about, kept, strict=True):
            row[1 : 1 + len(shape)] = shape
        entry[3] = put(about)
        addresses += [(entry[3] + TABLE * k, start) for k, (start, _) in enumerate(kept)]
    head = [place, len(entries), len(addresses), 0]
    first = np.array([*head, *np.ravel(entries), *np.ravel(np.array(addresses, dtype=np.int64))], dtype=np.int64)
    return np.concatenate([first, *pieces])


def packed_rows(rows: Array | None, parts: Sequence[Part]) -> Array:
    """The rows (ROWS,) with which a loop begins: those of world and seen, or zeros; inputs that do nothing; and the parts'."""
    every = np.zeros(ROWS)
    if rows is not None:
        every[: WORLD + SEEN] = rows
    every[WORLD + SEEN :] = FIRST
    for part in parts:
        for row, value in part.rows.items():
            every[row] = value
    return every


def packed_image(rows: Array, parts: Sequence[Words]) -> Words:
    """The image of a loop that begins with ``rows`` (ROWS,) and runs the packed ``parts`` in order."""
    words = HEAD + ROWS + sum(len(part) for part in parts)
    head = np.array([MAGIC, words, len(parts), ROWS, 0, 0, 0, 0], dtype=np.int64)
    return np.concatenate([head, rows.view(np.int64), *parts])


def changing_words(image: Words) -> list[tuple[int, int]]:
    """Where the words of an image are that running it changes, (first, beyond the last), in order: rows, the memory and tables
    of stages, and the addresses of tables, which are written anew before they are used. All others say what the loop is."""
    found, place = [(HEAD, HEAD + ROWS)], HEAD + ROWS
    for _ in range(image[2]):
        part = image[place:]
        words, stages, tables = (int(word) for word in part[:3])
        entries = part[PART_HEAD : PART_HEAD + ENTRY * stages].reshape(-1, ENTRY)
        addresses = part[PART_HEAD + ENTRY * stages :][: 2 * tables].reshape(-1, 2)
        found += [(place + memory, place + constants) for _, memory, constants, _ in entries.tolist() if memory != OF_INPUTS]
        ends = sorted([*addresses.ravel().tolist(), *entries[:, 3].tolist()])
        for described, table in addresses.tolist():
            beyond = next(end for end in ends if end > table)
            found += [(place + described, place + described + 1), (place + table, place + beyond)]
        place += words
    return sorted((first, last) for first, last in found if first < last)


INPUT_MEMORY: Array = np.zeros((0, 1))
"""Stands for the inputs as the memory of a stage."""
