"""Objects for a target, made in a process of their own; and the linker of PyPI's ``ziglang``."""

import hashlib
import json
import os
import pickle
import subprocess
import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from birthsim_build.code.blocks import WIDTH
from birthsim_build.code.threads import Threads
from birthsim_build.code.tools import run_tool
from birthsim_build.image import Words
from birthsim_env.extras import installation
from birthsim_env.files import temporary_folder
from birthsim_env.gradients.source import TEXTS
from birthsim_env.physics.compiled.kept import cache_folder, keep, kept
from birthsim_env.physics.compiled.sources import source_stamp

ONE_LANE = {
    **{"BIRTHSIM_BLOCK": "1", "NUMBA_LOOP_VECTORIZE": "0", "NUMBA_SLP_VECTORIZE": "0"},
    **{"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
}
"""Environment of the process that compiles for one lane, and not for the processor that it runs on."""

ON_A_WARP = {"BIRTHSIM_WARP": str(WIDTH)}
"""Further environment where threads run lanes; in WebAssembly, which has one thread, kernels are as for one lane alone."""

LEAST_LLVM = 22
"""LLVM 20 gives ``baselines.estimation.observers.observe`` other bits once the function is local to the code; LLVM 21 is
untried."""

EMULATIONS = {"x86-64": "elf_x86_64", "aarch64": "aarch64linux"}
"""Targets with shared libraries -> what the linker calls them."""


def compile_object(
    functions: Sequence[str],
    target: str,
    out: Path,
    data: Mapping[str, Words] | None = None,
    count: bool = False,
    threads: Threads | None = None,
) -> None:
    """Write the object file ``out`` of stages (``module:name``), ``birthsim_advance`` and constant arrays of words.

    For a Cortex-M7 the assembly stands beside it, ``.s``; for PTX the text, ``.ptx``, stands in its place. Where it is to
    ``count``, the code counts its operations. Where there are ``threads``, they run lanes. Objects are kept
    beside the kernels' machine code: the same one of the same sources is not compiled twice.
    """
    request = {"functions": list(functions), "target": target, "count": count, "threads": threads}
    request["generated"] = [TEXTS[name] for name in _modules(request) if name in TEXTS]
    arrays = dict(data or {})
    place = _place(request, arrays)
    content = place and kept(place)
    files: dict[str, bytes] = pickle.loads(content) if content else _compiled(request, arrays)
    if place and not content:
        keep(place, pickle.dumps(files))
    for suffix, written in files.items():
        out.with_suffix(suffix).write_bytes(written)


def _compiled(request: dict[str, Any], arrays: dict[str, Words]) -> dict[str, bytes]:
    """Ending -> content of the files that the process writes."""
    further = ON_A_WARP if request["threads"] and request["target"] != "wasm" else {}
    with temporary_folder() as folder:
        place, out = folder / "data.npz", folder / "code.o"
        np.savez(place, **arrays)  # type: ignore[arg-type]
        subprocess.run(
            [sys.executable, "-m", "birthsim_build.code.emit"],
            input=json.dumps({**request, "data": str(place), "out": str(out)}),
            text=True,
            check=True,
            env={**os.environ, **ONE_LANE, **further},
        )
        return {path.suffix: path.read_bytes() for path in folder.glob("code.*")}


def _place(request: dict[str, Any], arrays: dict[str, Words]) -> Path | None:
    """Where the files of a request are kept, named by all that they depend on; of other data and sources there are none."""
    folder = cache_folder()
    if folder is None:
        return None
    modules = "birthsim_build.code.emit", __name__, *_modules(request)
    files = [import_module(module).__file__ for module in modules]
    sources = hashlib.sha256("".join(source_stamp(Path(str(file))) for file in files).encode())
    for name, words in arrays.items():
        sources.update(name.encode() + words.tobytes())
    versions = (*compiler_versions(), sys.implementation.cache_tag)
    kind = hashlib.sha256(repr((request, versions)).encode()).hexdigest()
    return folder / f"birthsim_build.{request['target']}-{kind[:16]}-{sources.hexdigest()[:16]}.objects"


def _modules(request: dict[str, Any]) -> list[str]:
    """Modules of stages and adjoints."""
    adjoints = request["threads"].adjoints if request["threads"] else ()
    return sorted({name.partition(":")[0] for name in (*request["functions"], *adjoints)})


def has_linker() -> bool:
    """Whether PyPI's ``ziglang`` is there."""
    return find_spec("ziglang") is not None


def compiler_versions() -> tuple[Any, ...]:
    """Of Numba, llvmlite and LLVM."""
    import llvmlite.binding  # late: who lists devices need not compile
    import numba

    return numba.__version__, llvmlite.__version__, llvmlite.binding.llvm_version_info


def require_llvm() -> None:
    """Raises ``ValueError`` for an LLVM before ``LEAST_LLVM``."""
    _, _, llvm_version_info = compiler_versions()
    if llvm_version_info[0] < LEAST_LLVM:
        found = ".".join(map(str, llvm_version_info))
        raise ValueError(f"llvmlite has LLVM {found}; allowed: {LEAST_LLVM} or later, llvmlite 0.50")


def require_linker() -> None:
    """Raises ``ValueError`` where PyPI's ``ziglang`` is missing."""
    if not has_linker():
        raise ValueError(f"linking needs the extra build: {installation('build')}")


def link(*arguments: str) -> None:
    """Run a linker of PyPI's ``ziglang``, ``wasm-ld`` or ``ld.lld``; ``ValueError`` where it refuses."""
    done = run_tool(sys.executable, "-m", "ziglang", *arguments)
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        raise ValueError(f"{arguments[0]} fails: {said[0]}")
