"""Results: one JSON file a study, with what made it, and whether the sources are still those."""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from baselines.work.calls import called_by
from birthsim_env.physics.compiled.sources import ROOT, source
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each

RESULTS = ROOT / "lab" / "results"
LIBRARIES = ("numpy", "numba", "scipy", "gymnasium")

Content = dict[str, Any]
"""What a file holds: ``command``, ``commit``, ``dirty``, ``date``, ``seconds``, ``pieces``, how many of them were there
before, ``processor``, ``versions``, ``settings``, seeds among them, ``units``, ``figures``, entries of the registry that were
``used``, and ``sources``: of each definition that it called a hash, by file and name."""


_SCHEMA = {
    "date": str, "commit": str, "seconds": float, "settings": dict, "figures": (dict, list), "sources": Each((str, dict)),
    "used?": Each(str),
}  # fmt: skip
MOST = 2**26
"""Bytes of a result; the largest has a million."""


def beginning() -> Content:
    """What makes a result that begins now; ``dirty`` are all files that are not as committed."""
    other = _git("diff", "--name-only", "HEAD"), _git("ls-files", "--others", "--exclude-standard")
    return {
        "command": " ".join(sys.argv),
        "commit": commit(),
        "dirty": [path for paths in other for path in paths.splitlines()],
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "processor": _processor(),
        "versions": {"python": platform.python_version()} | {library: version(library) for library in LIBRARIES},
    }


def provenance(begun: Content, functions: Iterable[Callable[..., Any]], used: Mapping[str, str]) -> Content:
    """What made a result, once all that ``functions`` used is known; ``dirty`` if a file that they call was."""
    sources = dict[str, dict[str, str]]()
    for place, code in _called(functions, used).items():
        file, _, name = place.partition(":")
        sources.setdefault(file, {})[name] = code
    return {**begun, "dirty": any(path in sources for path in begun["dirty"]), "used": dict(used), "sources": sources}


def commit() -> str:
    """The newest commit here."""
    return _git("rev-parse", "HEAD")


def written(content: Any) -> str:
    """JSON with a line for each innermost list or short dictionary; ``ValueError`` for a number that is not finite."""
    return _lines(content) + "\n"


def read_result(name: str, folder: Path | None = None) -> Content | None:
    """The stored result of a study, if there is one; of ``RESULTS``, or another folder."""
    file = (folder or RESULTS) / f"{name}.json"
    return read_json("result", file, _SCHEMA, MOST) if file.is_file() else None


def changed(content: Content, functions: Iterable[Callable[..., Any]]) -> list[str]:
    """Definitions that changed or came since a result was measured by ``functions``.

    Results from before definitions were followed have hashes of whole files; of these the files that changed are named.
    """
    then = content["sources"]
    if "used" not in content:
        return [path for path, code in then.items() if not os.path.isfile(ROOT / path) or source(ROOT / path).code != code]
    known = {f"{file}:{name}": code for file, names in then.items() if isinstance(names, dict) for name, code in names.items()}
    return [place for place, code in _called(functions, content["used"]).items() if known.get(place) != code]


def _called(functions: Iterable[Callable[..., Any]], used: Mapping[str, str]) -> dict[str, str]:
    """What ``called_by`` says, in hashes of 48 bits, which tell versions of one definition apart."""
    return {place: code[:12] for place, code in called_by(functions, used).items()}


def _lines(content: Any, indent: str = "\n") -> str:
    items = content.values() if isinstance(content, dict) else content if isinstance(content, (list, tuple)) else ()
    if not any(isinstance(item, (dict, list, tuple)) for item in items) and not (isinstance(content, dict) and len(items) > 12):
        return json.dumps(content, allow_nan=False)
    inner = indent + " "
    if isinstance(content, dict):
        return (
            "{" + ",".join(f"{inner}{json.dumps(key)}: {_lines(item, inner)}" for key, item in content.items()) + indent + "}"
        )
    return "[" + ",".join(inner + _lines(item, inner) for item in content) + indent + "]"


def _git(*arguments: str) -> str:
    return subprocess.run(["git", "-C", str(ROOT), *arguments], check=True, capture_output=True, text=True).stdout.strip()


def _processor() -> str:
    file = Path("/proc/cpuinfo")
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    return next((line.partition(": ")[2] for line in lines if line.startswith("model name")), platform.machine())
