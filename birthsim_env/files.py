"""Folders and files that appear whole or not at all, and folders that one process has to itself."""

import json
import math
import os
import shutil
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

_PARTIAL = ".partial"
"""Ending of the hidden names of what is not complete."""

ENDINGS = [signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if name in signal.Signals.__members__]
"""Signals that ask a process to end; Windows has two of them."""


def make_folder(path: Path) -> Path:
    """The folder ``path``, made if it is missing, without hidden files that killed processes left; ``ValueError`` where that
    cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise ValueError(f"--out {str(path)!r} is a file; allowed: a folder, or a name for a new one") from None
    except OSError as error:
        raise ValueError(f"--out {str(path)!r} cannot be made ({error.strerror}); allowed: a folder to write to") from error
    for leftover in path.rglob(f".*{_PARTIAL}"):
        if not _is_written(leftover):
            shutil.rmtree(leftover) if leftover.is_dir() else leftover.unlink(missing_ok=True)
    return path


@contextmanager
def own_folder(path: Path) -> Iterator[Path]:
    """The folder ``path``, made if it is missing, which no other process has at the same time; ``ValueError`` where one has.

    The system frees the folder when the process ends, whatever ends it.
    """
    from filelock import FileLock, Timeout  # which loads asyncio

    make_folder(path)
    try:
        with FileLock(path / ".lock", timeout=0):
            yield path
    except Timeout:
        said = f"--out {str(path)!r} is in use by another process; allowed: to wait for it, or another folder"
        raise ValueError(said) from None


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A binary file to write to, which becomes ``path`` at the end; nothing of it stays where something is raised.

    It is on the disk before it has its name. A process that is killed leaves a hidden file, which ``make_folder`` removes.
    """
    partial = _partial(path)
    try:
        with partial.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError as error:
        if error.errno is not None:
            # A full disk does not say which file it had no room for, and others say the hidden name.
            error.filename = str(path)
        raise
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def whole_results(folder: Path) -> Iterator[Path]:
    """A folder for several files that belong together: at the end they replace those in ``folder``, one rename each.

    Where something is raised, such as for a full disk, ``folder`` stays as it was.
    """
    place = _partial(folder / "results")
    place.mkdir()
    try:
        yield place
        with later_signals():
            for path in sorted(place.iterdir()):
                path.replace(folder / path.name)
    finally:
        shutil.rmtree(place, ignore_errors=True)


@contextmanager
def later_signals() -> Iterator[None]:
    """What happens here is not torn by a signal that asks the process to end: that comes after it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {ending: signal.signal(ending, lambda number, _: came.append(number)) for ending in ENDINGS}
    try:
        yield
    finally:
        for ending, handler in before.items():
            signal.signal(ending, handler)
        for one in came:
            signal.raise_signal(one)


def write_text(path: Path, text: str) -> None:
    """Write text as a whole or not at all."""
    with whole_file(path) as file:
        file.write(text.encode())


def write_json(path: Path, content: Any) -> None:
    """Write JSON as a whole or not at all; a number that is not finite becomes null, for which JSON has no other word."""
    write_text(path, json.dumps(finite(content), indent=1, allow_nan=False))


def finite(content: Any) -> Any:
    """``content`` with None for every number that is not finite, at any depth."""
    if isinstance(content, dict):
        return {name: finite(value) for name, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def _partial(path: Path) -> Path:
    """The hidden name of what this process writes and ``path`` will be."""
    return path.with_name(f".{path.name}.{os.getpid()}{_PARTIAL}")


def _is_written(partial: Path) -> bool:
    """Whether the process that writes a hidden file may still run; on Windows, which cannot be asked, it may."""
    if os.name == "nt":
        return True
    process = partial.name.removesuffix(_PARTIAL).rpartition(".")[2]
    try:
        os.kill(int(process) if process.isdecimal() else os.getpid(), 0)
    except OSError as error:
        return not isinstance(error, ProcessLookupError)  # it may be another user's
    return True
