"""Builds the folder that ``compiled.prebuilt`` reads: libraries, the index of their kernels, and what their sources hold.

Objects are kept, a kernel a file, under all that they depend on, so that after an edit only what was edited is compiled.
The bytes are those of a build from nothing, since each kernel is compiled in a process of its own.
"""

import hashlib
import json
import os
import pickle
from collections.abc import Iterable, Mapping, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

from birthsim_build.code.compiler import compiler_versions
from birthsim_build.kernels import compiling
from birthsim_build.kernels.joining import join
from birthsim_build.kernels.paths import PATHS
from birthsim_build.kernels.recording import record
from birthsim_build.kernels.wanted import Wanted, asked, declared
from birthsim_env.files import make_folder, write_text
from birthsim_env.physics.compiled.kept import keep, kept
from birthsim_env.physics.compiled.prebuilt import FORMAT, symbol_of, target
from birthsim_env.physics.compiled.sources import dependencies, place_of, source, source_stamp, stamp_of


class Made(NamedTuple):
    """A kernel with its stamp, the kind of its result, and its objects by library."""

    wanted: Wanted
    stamp: str
    result: str
    objects: dict[str, bytes]


def build(out: Path, libraries: Sequence[str], work: Path) -> list[Made]:
    """Write the folder ``out`` with these ``libraries``; what is kept goes to ``work``. Returns all kernels, by their keys."""
    known = declared()
    # Those paths go on machine code, where it runs here.
    own = [name for name in libraries if name == target()]
    write(make_folder(work / "first"), made(known, libraries, work), own)
    found = {one.key: one for one in (*known, *asked(*record(PATHS, work / "first", work / "paths")))}
    every = made([found[key] for key in sorted(found)], libraries, work)
    write(make_folder(out), every, libraries)
    return every


def made(kernels: Sequence[Wanted], libraries: Sequence[str], work: Path) -> list[Made]:
    """Compile kernels, on all processors, but for what is kept of them in ``work``."""
    folder = make_folder(work / "objects")
    # Of the sources that are imported here: a kernel that is edited meanwhile is compiled as it was.
    stamps = [stamp_of(one.kernel.py_func) for one in kernels]
    jobs = [(one, _place(one, stamp, folder), libraries) for one, stamp in zip(kernels, stamps, strict=True)]
    # The longest first.
    order = sorted(range(len(jobs)), key=lambda k: -len(jobs[k][0].kernel.py_func.__code__.co_code))
    with get_context("fork").Pool(len(os.sched_getaffinity(0)), maxtasksperchild=1) as pool:
        results = pool.imap(_made, [jobs[k] for k in order], chunksize=1)
        done = dict(zip(order, tqdm(results, "kernels", len(jobs), leave=False, unit=" kernels"), strict=True))
    return [Made(one, stamp, *done[k]) for k, (one, stamp) in enumerate(zip(kernels, stamps, strict=True))]


def _place(wanted: Wanted, stamp: str, folder: Path) -> Path:
    """Where the objects of a kernel are kept."""
    built = stamp, *compiler_versions(), source_stamp(Path(compiling.__file__).resolve())
    return folder / f"{symbol_of(wanted.key)}-{hashlib.sha256(repr(built).encode()).hexdigest()[:16]}.objects"


def _made(job: tuple[Wanted, Path, Sequence[str]]) -> tuple[str, dict[str, bytes]]:
    """Result and objects of a kernel."""
    wanted, place, libraries = job
    held = kept(place)
    result, objects = pickle.loads(held) if held else ("", {})
    missing = [name for name in libraries if name not in objects]
    if missing:
        result, new = compiling.objects_of(wanted.kernel, wanted.kinds, symbol_of(wanted.key), missing)
        objects = {**objects, **new}
        keep(place, pickle.dumps((result, objects)))
    return result, {name: objects[name] for name in libraries}


def write(out: Path, kernels: Sequence[Made], libraries: Iterable[str]) -> None:
    """Write libraries, ``index.json`` and ``sources.json`` to the folder ``out``."""
    files = {}
    for name in libraries:
        place = out / name
        join(name, {symbol_of(one.wanted.key): one.objects[name] for one in kernels}, place)
        files[name] = hashlib.sha256(place.read_bytes()).hexdigest()
    index = {one.wanted.key: [one.stamp, one.result] for one in kernels}
    write_text(out / "index.json", _lines({"format": FORMAT, "libraries": files, "kernels": index}))
    write_text(out / "sources.json", _lines(sources_of(kernels)))


def sources_of(kernels: Iterable[Made]) -> dict[str, Any]:
    """What every file holds that kernels are made of, by what ``sources`` calls its content."""
    first = {Path(one.wanted.kernel.py_func.__code__.co_filename).resolve() for one in kernels}
    found = {place_of(path.read_bytes()): source(path) for path in dependencies(first)}
    return dict(sorted(found.items()))


def _lines(content: Mapping[str, Any]) -> str:
    """JSON with a line an entry, so that differences are read."""
    lines = (f"{json.dumps(key)}: {_lines(one) if isinstance(one, dict) else json.dumps(one)}" for key, one in content.items())
    return "{\n" + ",\n".join(lines) + "\n}"
