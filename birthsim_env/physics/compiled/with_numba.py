"""What Numba makes of kernels where no prebuilt code serves: machine code kept on disk, and a word while a user waits.

Numba's own cache looks at the file of the outermost function only. Ours names a file by everything that the machine code
depends on: the code of all files that the kernel's module imports, directly or not, the signature, the processor and the
versions.
A file that is missing, damaged or cannot be written costs a compilation, never the command.
"""

import hashlib
import os
import pickle
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import llvmlite
import llvmlite.binding
import numba
from numba.core import event, serialize, types
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.registry import CPUDispatcher, cpu_target

import birthsim_env.physics.compiled.resolution  # noqa: F401 (what Numba is asked first)
from birthsim_env.physics.compiled.blocks import BLOCK, WARP
from birthsim_env.physics.compiled.kept import cache_folder, keep, kept
from birthsim_env.physics.compiled.record_types import block_type
from birthsim_env.physics.compiled.sources import is_ours, stamp_of


class _DiskCache(NullCache):
    """Machine code of one function: a file per signature and processor."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._folder = folder
        # The module of a user's file has its whole path for a name.
        self._name = f"{Path(function.__module__).name}.{function.__qualname__}"
        self._stamp = stamp_of(function)

    def _path(self, signature: Any, codegen: Any) -> Path:
        versions = (numba.__version__, llvmlite.__version__, sys.implementation.cache_tag)
        how = (BLOCK, WARP, *(os.environ.get(f"NUMBA_{kind}_VECTORIZE") for kind in ("LOOP", "SLP")))
        kind = hashlib.sha256(repr((signature, codegen.magic_tuple(), versions, how)).encode()).hexdigest()
        return self._folder / f"{self._name}-{kind[:16]}-{self._stamp}.nbc"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        target_context.refresh()
        content = kept(self._path(sig, target_context.codegen()))
        return content and CompileResult._rebuild(target_context, *pickle.loads(content))  # type: ignore[no-untyped-call]

    def save_overload(self, sig: Any, data: Any) -> None:
        keep(self._path(sig, data.codegen), serialize.dumps(data._reduce()))  # type: ignore[no-untyped-call]


class _Announcer(event.Listener):
    """Says once per process that kernels are being compiled, since the first step of a new installation waits for it."""

    def __init__(self) -> None:
        self._said = False

    def on_start(self, event: Any) -> None:
        module = getattr(event.data["dispatcher"].py_func, "__module__", "") or ""
        if not self._said and is_ours(module):
            self._said = True
            then = "the result is cached" if cache_folder() else "no folder is writable, so every process compiles anew"
            print(f"BirthSIM: compiling numerical kernels, usually 10 to 40 s; {then}.", file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass


# LLVM finds that nothing else points into a block of scratch only if it may look at all uses of the block: one for every row.
llvmlite.binding.set_option("birthsim", "-capture-tracking-max-uses-to-explore=2000")

ANNOUNCER = _Announcer()
event.register("numba:compile", ANNOUNCER)  # type: ignore[no-untyped-call]


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a loop over lanes; cached on disk where a folder is writable; releases the interpreter lock."""
    compiled: Any = numba.njit(error_model="numpy", nogil=True)(function)
    folder = cache_folder()
    # What a closure or an interactive session holds, no hash of sources knows.
    written = Path(function.__code__.co_filename).is_file()
    if folder is not None and function.__closure__ is None and written:
        compiled._cache = _DiskCache(function, folder)
    return compiled


class _Inlined(JITCodeLibrary):
    """Code of a helper. Machine code is made of the kernels that it is inlined into, so it is not optimised by itself."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: Python calls the kernel that a helper is when it stands alone."""
        return 0

    @property
    def codegen(self) -> Any:
        """What keeps the constants of Python's exceptions beside machine code; here there is none."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        pass


class _Inlining(Compiler):
    def __init__(self, typing: Any, target: Any, _: Any, *others: Any) -> None:
        super().__init__(typing, target, _Inlined(target.codegen(), "helper"), *others)  # type: ignore[no-untyped-call]


class _Helper(CPUDispatcher):
    """What kernels see of a helper; from Python it is a kernel of its own."""

    def __init__(self, function: Callable[..., Any]) -> None:
        options = {name: True for name in ("nopython", "forceinline", "no_cpython_wrapper", "no_cfunc_wrapper")}
        super().__init__(function, targetoptions={**options, "error_model": "numpy"}, pipeline_class=_Inlining)


def helper(function: Callable[..., Any]) -> Any:
    """A function that is always inlined into the kernels that call it."""
    return _Helper(function)


def type_of(value: Any) -> Any:
    """The type of what kernels call of Numba, or of Numba's extensions."""
    context: Any = cpu_target.typing_context
    context.refresh()
    return context.resolve_value_type(value)


def compiled_stage(stage: Any, layouts: Sequence[Any]) -> Any:
    """What Numba made of a stage whose arguments have these layouts, None for a whole number; compiled when first asked for."""
    arguments = tuple(block_type(layout) if layout else types.int64 for layout in layouts)
    if arguments not in stage.numba.overloads:
        stage.numba.compile(types.int64(*arguments))
    return stage.numba.overloads[arguments]


def dumped(function: Callable[..., Any]) -> bytes:
    """A function by value, with what it refers to."""
    content: bytes = serialize.dumps(function)  # type: ignore[no-untyped-call]
    return content
