"""PTX, the code of NVIDIA's graphics processors: its assembler, and what a thread takes."""

import re
import shutil
from importlib.util import find_spec
from pathlib import Path

from birthsim_build.code.tools import run_tool
from birthsim_env.extras import installation

GPU = re.compile(r"sm_\d{2,3}[a-z]?")
_FUNCTION = re.compile(r"Function properties for (\w+)\s+(\d+) bytes stack frame, (\d+) bytes spill stores")
_TAKEN = re.compile(r"Compiling entry function '(\w+)'.*?Used (\d+) registers([^\n]*)", re.DOTALL)
_SHARED = re.compile(r"(\d+) bytes smem")


def assembler() -> str | None:
    """Where ``ptxas`` is, on the path or of a wheel of NVIDIA's; None where it is not."""
    folders = getattr(find_spec("nvidia"), "submodule_search_locations", None) or ()
    of_wheels = (str(path) for folder in folders for path in Path(folder).glob("*/bin/ptxas"))
    return shutil.which("ptxas") or next(of_wheels, None)


def require_assembler() -> str:
    """Where ``ptxas`` is; raises ``ValueError`` where it is not."""
    found = assembler()
    if found is None:
        raise ValueError(f"a cubin needs NVIDIA's ptxas: {installation('cuda')}")
    return found


def assemble(ptx: Path, cubin: Path, gpu: str, *options: str) -> dict[str, int]:
    """Write machine code for a ``gpu``, sm_90 for one; returns what a thread of ``birthsim_advance`` takes.

    ``memory``: bytes of its own. ``spilled``: those that hold what did not fit into registers, in all functions. ``shared``:
    bytes that its block shares. Raises ``ValueError`` for a GPU that ``ptxas`` does not know.
    """
    if not GPU.fullmatch(gpu):
        raise ValueError(f"gpu = {gpu!r}; allowed: sm_ and the number of an architecture, as sm_90")
    line = [require_assembler(), "-v", f"-arch={gpu}", *options, str(ptx), "-o", str(cubin)]
    done = run_tool(*line)
    said = done.stdout + done.stderr
    if done.returncode:
        raise ValueError(f"ptxas for gpu = {gpu!r} fails: {said.strip().splitlines()[0]}")
    functions = {name: (int(frame), int(stored)) for name, frame, stored in _FUNCTION.findall(said)}
    taken = {name: (int(count), _SHARED.search(more)) for name, count, more in _TAKEN.findall(said)}
    own = "birthsim_advance"
    registers, shared = taken[own]
    return {
        "memory": functions[own][0], "spilled": sum(stored for _, stored in functions.values()), "registers": registers,
        "shared": int(shared[1]) if shared else 0,
    }  # fmt: skip
