"""What is computed once and kept on disk, where a folder is writable: machine code of kernels, and what source files hold."""

import contextlib
import hashlib
import os
import tempfile
from functools import cache
from pathlib import Path

from birthsim_env.files import whole_file

PACKAGE = Path(__file__).resolve().parents[2]

_DIGEST = hashlib.sha256().digest_size


@cache
def cache_folder() -> Path | None:
    """The first writable folder: $NUMBA_CACHE_DIR, beside the sources, the user's cache; None when there is none."""
    chosen, home = os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME")
    folders = [Path(chosen)] if chosen else []
    folders.append(PACKAGE / "__pycache__")
    with contextlib.suppress(RuntimeError):  # of a user without a home directory
        folders.append(Path(home or Path.home() / ".cache") / "birthsim")
    for folder in folders:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return None


def kept(path: Path) -> bytes | None:
    """What ``keep`` wrote; None where a file is missing or damaged."""
    with contextlib.suppress(OSError):
        content = path.read_bytes()
        if hashlib.sha256(content[_DIGEST:]).digest() == content[:_DIGEST]:
            return content[_DIGEST:]
    return None


def keep(path: Path, content: bytes) -> None:
    """Write ``content`` behind its SHA-256, whole or, where there is no room, not at all.

    Files of older sources, whose names differ only after the last ``-``, go.
    """
    with contextlib.suppress(OSError):
        with whole_file(path) as file:
            file.write(hashlib.sha256(content).digest() + content)
        for other in path.parent.glob(f"{path.stem.rpartition('-')[0]}-*{path.suffix}"):
            if other != path:
                other.unlink(missing_ok=True)
