"""Optuna's journal of a search in a folder that one process has to itself, as a killed process may have left it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from optuna.storages import JournalStorage


class _NoLock:
    """Instead of Optuna's lock file, which outlives a process that is killed: the folder has one owner already."""

    def acquire(self) -> bool:
        return True

    def release(self) -> None:
        pass


def open_journal(path: Path) -> JournalStorage:
    """The journal at ``path``, without a last line that has no end; needs the extra ``tune``."""
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend

    if path.exists():
        content = path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            with path.open("r+b") as file:
                file.truncate(whole)
    return JournalStorage(JournalFileBackend(str(path), cast(Any, _NoLock())))
