"""How kernels are compiled: two Numba decorators, a cache that notices changed helpers, and a word while a user waits.

Kernels run over lanes (environments). They are written so that LLVM vectorises the innermost loop: quantities are rows of
scratch arrays whose shape is a compile-time constant, helpers are always inlined, conditions are max, min or a ternary, and
only + - * / sqrt occur inside. Without ``fastmath`` every operation is IEEE-exact, so a lane computes the same bits
whether it runs in a vector register or alone.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import event
from numba.core.caching import CacheImpl, _CacheLocator

F = TypeVar("F", bound=Callable[..., Any])

BLOCK = 32
"""Lanes per block: the scratch rows of one block fit the first-level cache, and their constant stride lets LLVM vectorise."""

_ROOT = Path(__file__).resolve().parent.parent
_PACKAGES = ("birthsim_env", "baselines", "agents")


@cache
def _source_stamp() -> str:
    """One hash of all kernels and the row numbers they share: Numba itself looks at the outermost function's file only."""
    digest = hashlib.sha256(numba.__version__.encode())
    for package in _PACKAGES:
        for path in sorted((_ROOT / package).rglob("*.py")):
            text = path.read_bytes()
            if b"\n@kernel\n" in text or b"\n@helper\n" in text or path.name in ("compilation.py", "lanes.py"):
                digest.update(str(path.relative_to(_ROOT)).encode() + text)
    return digest.hexdigest()


@cache
def _cache_folder() -> str | None:
    """The first writable folder: $NUMBA_CACHE_DIR, beside the sources, the user's cache; None when there is none."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    for folder in ([Path(chosen)] if chosen else []) + [_ROOT / "birthsim_env" / "__pycache__", home / "birthsim"]:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return str(folder)
        except OSError:
            continue
    return None


class _PackageCacheLocator(_CacheLocator):
    """Keeps machine code of this project's kernels under a stamp of all of them."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        # Files of the same name in two packages may have a function of the same name in the same line.
        place = Path(py_file).resolve().relative_to(_ROOT).with_suffix("").parts
        self._place = f"{'-'.join(place)}-{py_func.__code__.co_firstlineno}"

    def get_cache_path(self) -> str:
        return str(_cache_folder())

    def get_source_stamp(self) -> str:
        return _source_stamp()

    def get_disambiguator(self) -> str:
        return self._place

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> _PackageCacheLocator | None:
        ours = any(Path(py_file).resolve().is_relative_to(_ROOT / package) for package in _PACKAGES)
        return cls(py_func, py_file) if ours and _cache_folder() else None


class _Announcer(event.Listener):
    """Says once per process that kernels are being compiled, since the first step of a new installation waits for it."""

    def __init__(self) -> None:
        self._said = False

    def on_start(self, event: Any) -> None:
        module = getattr(event.data["dispatcher"].py_func, "__module__", "") or ""
        if not self._said and module.split(".")[0] in _PACKAGES:
            self._said = True
            kept = "the result is cached" if _cache_folder() else "no folder is writable, so every process compiles anew"
            print(f"BirthSIM: compiling numerical kernels, usually 10 to 40 s; {kept}.", file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass


if _PackageCacheLocator not in CacheImpl._locator_classes:
    CacheImpl._locator_classes.insert(0, _PackageCacheLocator)
    event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]


def kernel(function: F) -> F:
    """Compile a loop over lanes; cached on disk where a folder is writable; releases the interpreter lock."""
    compiled: Any = numba.njit(error_model="numpy", cache=_cache_folder() is not None, nogil=True)(function)
    return compiled  # type: ignore[no-any-return]


def helper(function: F) -> F:
    """Compile a scalar helper that is always inlined into the kernels that call it."""
    compiled: Any = numba.njit(error_model="numpy", forceinline=True)(function)
    return compiled  # type: ignore[no-any-return]
