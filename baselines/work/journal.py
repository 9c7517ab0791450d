"""Optuna's journal of a search in a folder that one process has to itself, as a killed process may have left it."""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from optuna.storages import JournalStorage


def open_journal(path: Path) -> JournalStorage:
    """The journal at ``path``, without a last line that has no end; needs the extra ``tune``."""
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend

    if path.exists():
        os.truncate(path, path.read_bytes().rfind(b"\n") + 1)
    # Optuna's own lock file outlives a process that is killed: the folder has one owner already.
    return JournalStorage(JournalFileBackend(str(path), cast(Any, threading.Lock())))
