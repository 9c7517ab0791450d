"""Programs of others that build (zig, ptxas, gcc), run in one way: with a folder for what they keep, even without a HOME."""

import os
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from birthsim_env.files import temporary_folder
from birthsim_env.physics.compiled.kept import cache_folder


def run_tool(*line: str) -> subprocess.CompletedProcess[str]:
    """Run a program and its arguments; what it says is kept, and its exit status is not looked at."""
    with tool_environment() as environment:
        return subprocess.run(line, capture_output=True, text=True, errors="replace", check=False, env=environment)


@contextmanager
def tool_environment() -> Iterator[dict[str, str]]:
    """Environment of this process, where tools can keep files in it; else with a folder of BirthSIM's as home.

    A container or a service may have no HOME, or one that is read-only: zig then ends, or never does.
    """
    if os.name == "nt" or _keeps(os.environ):
        yield dict(os.environ)
        return
    folder = cache_folder()
    if folder is not None:
        yield _at(folder / "tools")
        return
    with temporary_folder() as place:
        yield _at(place)


def _at(folder: Path) -> dict[str, str]:
    """The environment of tools that keep their files in ``folder``."""
    kept = folder / "cache"
    kept.mkdir(parents=True, exist_ok=True)
    return {**os.environ, "HOME": str(folder), "XDG_CACHE_HOME": str(kept), "ZIG_GLOBAL_CACHE_DIR": str(kept / "zig")}


def _keeps(environment: Mapping[str, str]) -> bool:
    """Whether the user's own folder for such files can be written."""
    home, chosen = environment.get("HOME", ""), environment.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(home) or not os.path.isdir(home):
        return False
    folder = Path(chosen) if os.path.isabs(chosen) else Path(home) / ".cache"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
