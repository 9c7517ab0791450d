"""Folders and files that appear whole or not at all, and folders that one process has to itself."""

import errno
import json
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from birthsim_env.endings import later_signals
from birthsim_env.partials import place, shared, tidy_below


def make_folder(path: Path) -> Path:
    """The folder ``path``, made if it is missing; ``ValueError`` where that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise ValueError(f"--out {str(path)!r} is a file; allowed: a folder, or a name for a new one") from None
    except OSError as error:
        raise ValueError(f"--out {str(path)!r} cannot be made ({error.strerror}); allowed: a folder to write to") from error
    return path


@contextmanager
def own_folder(path: Path) -> Iterator[Path]:
    """The folder ``path``, made if it is missing, which no other process has at the same time; ``ValueError`` where one has.

    The system frees the folder when the process ends, whatever ends it; then the next one removes what that one left. Two hosts
    see each other where the disk shares its locks, as NFS does by default.
    """
    from filelock import FileLock, Timeout  # which loads asyncio

    lock = make_folder(path) / ".lock"
    new = not lock.exists()
    try:
        with FileLock(lock, timeout=0):
            if new:
                shared(lock)
            tidy_below(path)
            yield path
    except Timeout:
        said = f"--out {str(path)!r} is in use by another process; allowed: to wait for it, or another folder"
        raise ValueError(said) from None


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder that is gone at the end; a signal to end waits while it is made and while it is removed."""
    from tempfile import TemporaryDirectory  # late: few need it

    with later_signals():
        made = TemporaryDirectory()
    try:
        yield Path(made.name)
    finally:
        with later_signals():
            made.cleanup()


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A binary file to write to, which becomes ``path`` at the end; nothing of it stays where something is raised.

    It is on the disk before it has its name. A process that is killed leaves a hidden ``place``, and the next one that writes
    there removes it.
    """
    try:
        with place(path.parent) as own:
            with (own / path.name).open("wb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            (own / path.name).replace(path)
    except OSError as error:
        if error.errno is not None:
            # A full disk does not say which file it had no room for, and others say the hidden name.
            error.filename, error.filename2 = str(path), None
        raise


@contextmanager
def whole_results(folder: Path) -> Iterator[Path]:
    """A folder for several files that belong together: at the end they replace those in ``folder``, one rename each.

    Where something is raised, such as for a full disk, ``folder`` stays as it was.
    """
    with place(folder) as own:
        yield own
        with later_signals():
            _join(own, folder)


@contextmanager
def whole_folder(folder: Path, name: str) -> Iterator[Path]:
    """A place for a folder ``name``, at any depth, and for files beside its parents; at the end both join those in ``folder``.

    ``folder / name`` appears by one rename, as the last, and is new: raises ``OSError`` where it is there by then.
    """
    with place(folder) as own:
        yield own
        steps = [own, *(own / one for one in reversed(Path(name).parents) if one.name)]
        if (folder / name).exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(folder / name))
        with later_signals():
            for one in steps:
                (folder / one.relative_to(own)).mkdir(exist_ok=True)
                _join(one, folder / one.relative_to(own))
            (own / name).rename(folder / name)


def _join(own: Path, folder: Path) -> None:
    """Rename the files of a folder into another one, all or, where a folder has the name of one, none; folders stay."""
    steps = [(path, folder / path.name) for path in sorted(own.iterdir()) if path.is_file()]
    for _, there in steps:
        if there.is_dir() and not there.is_symlink():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(there))
    for path, there in steps:
        path.replace(there)


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
