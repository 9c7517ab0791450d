"""Results: one JSON file a study, with what made it, and whether the sources are still those."""

import json
import platform
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from birthsim_env.physics.compiled.sources import ROOT, hashes
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each

RESULTS = ROOT / "lab" / "results"
LIBRARIES = ("numpy", "numba", "scipy", "gymnasium")

ENGINE = (
    "baselines/work/", "birthsim/command_line/", "baselines/about.py", "birthsim_env/files.py",
    "birthsim_env/partials.py", "birthsim_env/physics/rig/json_reading.py", "birthsim_env/physics/rig/schema.py",
    "birthsim_env/physics/compiled/sources.py", "birthsim_env/physics/compiled/kept.py", "birthsim_env/drawing/",
    "baselines/figures/", "lab/studies/study.py", "lab/studies/results.py", "lab/studies/tables.py",
)  # fmt: skip
"""What reads options, keeps pieces, describes controllers and draws, and decides no figure. It makes no result stale."""

Content = dict[str, Any]
"""What a file holds: ``command``, ``commit``, ``dirty``, ``date``, ``seconds``, ``pieces``, how many of them were there
before, ``processor``, ``versions``, ``settings``, seeds among them, ``units``, ``figures``, and hashes of ``sources``."""


_SCHEMA = {
    "date": str, "commit": str, "seconds": float, "settings": dict, "figures": (dict, list), "sources": Each(str),
}  # fmt: skip
MOST = 2**26
"""Bytes of a result; the largest has a million."""


def provenance(modules: tuple[str, ...]) -> Content:
    """What makes a result now, whose figures ``modules`` measure; ``dirty`` if one of their sources is not as committed."""
    sources = hashes(*modules)
    return {
        "command": " ".join(sys.argv), "commit": commit(),
        "dirty": bool(_git("status", "--porcelain", "--", *sources)), "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "processor": _processor(),
        "versions": {"python": platform.python_version()} | {library: version(library) for library in LIBRARIES},
        "sources": sources,
    }  # fmt: skip


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


def changed(content: Content, modules: tuple[str, ...]) -> list[str]:
    """Sources of ``modules`` that changed or came since a result was measured, but for ``ENGINE``."""
    then, now = content["sources"], hashes(*modules)
    return sorted(path for path, code in now.items() if not path.startswith(ENGINE) and then.get(path) != code)


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
