"""Where files lie until they are whole: ``FOLDER/.birthsim/``, in which every writer has a place of its own.

A place is a folder with a random name, beside ``PLACE.lock``, an empty file that its writer has locked. The system frees the
lock when the writer ends, whatever ends it, and the next writer in this folder then removes both. Process ids say nothing
here, because two containers that share a volume may have the same ones. Nothing of another name or kind is touched.

A lock says that a writer lives only where both processes see it. Two hosts do on NFS as it is mounted by default, and do not
with ``nolock``, with ``local_lock`` or without lockd. So the name of a lock says on which running system it was made, and what
was made on another one, or where nothing can be locked, stays for ``PATIENCE``.
"""

import hashlib
import os
import platform
import re
import secrets
import shutil
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from birthsim_env.endings import later_signals

HIDDEN = ".birthsim"
"""Name of the folder for what is not whole."""

PATIENCE = 7 * 24 * 3600.0
"""s, assumed: nobody writes one file for so long, and no two clocks differ by as much."""

_LOCK = re.compile(r"[0-9a-f]{32}-([0-9a-f]{16})\.lock")
"""A random name, and the system that it was made on."""


@contextmanager
def place(folder: Path) -> Iterator[Path]:
    """A new empty folder on the disk of ``folder``, for this writer alone, which is gone at the end.

    Raises ``OSError`` where ``folder`` cannot be written to, and ``ValueError`` where ``HIDDEN`` in it is no folder.
    """
    tidy(folder)
    made: list[tuple[Path, int]] = []
    try:
        with later_signals():  # which would leave a lock behind
            made.append(_new_lock(folder / HIDDEN))
        own = made[0][0].with_suffix("")
        own.mkdir()
        shared(own)
        yield own
    finally:
        with later_signals():
            for lock, descriptor in made:
                _remove(lock)
                os.close(descriptor)
                with suppress(OSError):  # others have places there
                    lock.parent.rmdir()


def tidy(folder: Path) -> None:
    """Remove the places below ``folder / HIDDEN`` whose writers have ended without doing so."""
    hidden = folder / HIDDEN
    if hidden.is_symlink():
        return
    try:
        inside = sorted(hidden.iterdir())
    except (FileNotFoundError, NotADirectoryError):
        return
    removed = [_remove_dead(lock) for lock in inside if _LOCK.fullmatch(lock.name)]
    if any(removed):
        with suppress(OSError):
            hidden.rmdir()


def tidy_below(folder: Path) -> None:
    """``tidy`` a folder and all folders in it."""
    for where, inside, _ in os.walk(folder):
        if HIDDEN in inside:
            inside.remove(HIDDEN)
            tidy(Path(where))


def shared(path: Path) -> None:
    """Whoever may write to the folder of ``path`` may write to ``path``: what a container's root left bars nobody else."""
    with suppress(OSError, AttributeError):  # a disk without owners, Windows
        like = path.parent.stat()
        mode = stat.S_IMODE(like.st_mode)
        path.chmod(mode if path.is_dir() else mode & 0o666)
        if os.geteuid() == 0:
            os.chown(path, like.st_uid, like.st_gid)


def _new_lock(hidden: Path) -> tuple[Path, int]:
    """A lock of this process, and its descriptor."""
    while True:
        # In one look: another writer, the last one there, may remove the folder between two.
        if not stat.S_ISDIR(_mode(hidden)):
            raise ValueError(f"{str(hidden)!r} is no folder; allowed: a folder of that name, or none")
        with suppress(FileExistsError):
            hidden.mkdir()
            shared(hidden)
        lock = hidden / f"{secrets.token_hex(16)}-{_system()}.lock"
        try:
            descriptor = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_EXCL)
        except FileNotFoundError:
            continue  # another writer, the last one there, has removed the folder
        # Before it is locked, another process may take it for one whose writer has ended.
        shared(lock)
        if _locked(descriptor) is not False and lock.exists():
            return lock, descriptor
        os.close(descriptor)


def _mode(hidden: Path) -> int:
    """What ``hidden`` is; a folder where there is nothing yet."""
    try:
        return hidden.lstat().st_mode
    except FileNotFoundError:
        return stat.S_IFDIR


def _remove_dead(lock: Path) -> bool:
    """Remove the place of a writer that has ended; whether it has."""
    try:
        descriptor = os.open(lock, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return False  # it is gone, or another user's
    try:
        # The lock is asked last: while this process has it, its writer cannot get it.
        old = time.time() - os.fstat(descriptor).st_mtime > PATIENCE
        here = lock.name.partition("-")[2] == f"{_system()}.lock"
        locked = _locked(descriptor)
        if not (old if locked is None else locked and (here or old)):
            return False
        _remove(lock)
        return True
    finally:
        os.close(descriptor)


def _remove(lock: Path) -> None:
    """Remove a place, and its lock last: what has no lock is nobody's."""
    own = lock.with_suffix("")
    shutil.rmtree(own, ignore_errors=True)
    if not own.exists():
        with suppress(OSError):
            lock.unlink()


def _locked(descriptor: int) -> bool | None:
    """Lock an open file: whether nobody else has; None where the system or the disk knows no such locks."""
    try:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except (ImportError, OSError):
        return None
    return True


@cache
def _system() -> str:
    """Sixteen digits that all processes between two starts of this system share, be they in containers or not."""
    try:
        name = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
    except (OSError, ValueError):
        name = platform.node()
    return hashlib.sha256(name.encode()).hexdigest()[:16]
