"""Devices: where the data of lanes are, and what runs programs there.

``host`` is this processor, with the code of a thread: what a graphics processor runs, without one.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from birthsim_build.code.blocks import WIDTH
from birthsim_build.code.compiler import compile_object, require_llvm
from birthsim_build.code.targets import HOST
from birthsim_build.code.threads import Threads
from birthsim_env.extras import installation
from birthsim_env.files import temporary_folder
from birthsim_env.physics.rig.values import shown

ROOM = 64
"""Rows of a thread's memory come in so many, so that loops with the same stages share their code."""

Run = Callable[..., None]
"""Runs one of ``Threads.runs``: called with its name, how many threads, the address of a program and two whole numbers."""


class Machine(Protocol):
    """A device; ``arrays`` is the module of its arrays, NumPy or what is like it."""

    arrays: Any

    def address(self, array: Any) -> int:
        """Where an array begins."""

    def local(self, array: Any) -> NDArray[Any]:
        """An array as one of NumPy's."""

    def load(self, functions: tuple[str, ...], threads: Threads) -> Run:
        """Code of stages for threads."""


class Host:
    """The processor of this process."""

    arrays: Any = np

    def __init__(self) -> None:
        if HOST is None:
            raise ValueError("device = 'host'; allowed: on Linux on x86-64 or aarch64")

    def address(self, array: Any) -> int:
        return int(array.ctypes.data)

    def local(self, array: Any) -> NDArray[Any]:
        return np.asarray(array)

    def load(self, functions: tuple[str, ...], threads: Threads) -> Run:
        engine = _engine(functions, threads)
        types = (*(ctypes.c_int64 for _ in range(3)), ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)
        place, own = engine.get_function_address, ctypes.CFUNCTYPE(None, *types)
        entries = {name: own(place(f"birthsim_{name}")) for name in threads.runs}

        def run(name: str, count: int, program: int, one: int, two: int) -> None:
            entry = entries[name]
            for block in range(-(-count // WIDTH)):
                for thread in range(WIDTH):
                    entry(thread, block, WIDTH, program, one, two)

        return run


@cache
def _engine(functions: tuple[str, ...], threads: Threads) -> Any:
    """The code in this process, for good: whoever has an address in it may use it."""
    import llvmlite.binding as llvm  # late: who lists devices need not compile

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(_compiled(functions, str(HOST), threads, ".o")))
    engine.finalize_object()
    return engine


def _compiled(functions: tuple[str, ...], target: str, threads: Threads, ending: str) -> bytes:
    require_llvm()
    space, back = (-(-rows // ROOM) * ROOM for rows in (threads.space, threads.back_space))
    with temporary_folder() as folder:
        out = folder / "code.o"
        compile_object(functions, target, out, threads=threads._replace(space=space, back_space=back))
        return out.with_suffix(ending).read_bytes()


class Cuda:
    """A graphics processor of NVIDIA's, by CuPy."""

    def __init__(self) -> None:
        try:
            self.arrays = import_module("cupy")
            self.arrays.cuda.runtime.getDeviceCount()
        except Exception as error:
            said = str(error).strip().partition("\n")[0]
            raise ValueError(f"device = 'cuda' needs NVIDIA's driver and the extra: {installation('cuda')} ({said})") from error

    def address(self, array: Any) -> int:
        return int(array.data.ptr)

    def local(self, array: Any) -> NDArray[Any]:
        return np.asarray(self.arrays.asnumpy(array))

    def load(self, functions: tuple[str, ...], threads: Threads) -> Run:
        with temporary_folder() as folder:
            path = folder / "code.ptx"
            path.write_bytes(_compiled(functions, "ptx", threads, ".ptx"))
            module = self.arrays.RawModule(path=str(path))
            entries = {name: module.get_function(f"birthsim_{name}") for name in threads.runs}
            for entry in entries.values():
                entry.compile()  # else the file is read at the first call

        def run(name: str, count: int, *arguments: int) -> None:
            entries[name]((-(-count // WIDTH),), (WIDTH,), tuple(map(np.int64, arguments)))

        return run


MACHINES: dict[str, Callable[[], Machine]] = {"host": Host, "cuda": Cuda}
"""Device -> what its arrays are, and what runs there; ``birthsim_build.device.episodes`` registers them."""


def machine_named(device: str) -> Machine:
    """The device of a name; ``ValueError`` for another name, and where something is missing."""
    if not isinstance(device, str) or device not in MACHINES:
        raise ValueError(f"device = {shown(device)}; allowed: {', '.join(map(repr, MACHINES))}")
    return MACHINES[device]()
