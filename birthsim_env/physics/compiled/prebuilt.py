"""Machine code that comes with the package: a library for each target, and an index by a kernel's name and arguments.

It serves while a kernel's sources are those that it was built from. Else, and for other arguments, Numba compiles, a kernel
at a time. ``BIRTHSIM_PREBUILT=0`` switches it off. The folder ``birthsim_env/prebuilt`` has

    <target>.so, .dylib, .dll    x86-64-v3, x86-64-v4, aarch64
    index.json                   {"format": FORMAT, "libraries": {file: SHA-256}, "kernels": {key: [stamp, result]}}
    sources.json                 {``sources.place_of`` a file: ``sources.Source``}, of all files that kernels are made of

A key is ``module.qualname`` and the kinds of the arguments with spaces between; the stamp is ``sources.stamp_of`` the function.
Kinds of numbers: i (int64), d (float64), b (bool), u (uint64); a result may also be n (none). An array is its ``dtype.char``,
its number of axes, C, F or A for its order, and r where it is not writeable: ``d2C``. An array by name (``Named``) stands
behind its layout, ``module.qualname:d2C``, where F is A. A stage's blocks are i, their addresses.

A kernel's symbol is ``symbol_of`` its key. Where all arguments and the result are i, it takes and returns int64: whoever calls
by address, as a loop its stages, needs nothing else. Any other is

    int32 symbol(void *result, ...)    0, or what Numba's code returns for an exception

with int64, double, bool as uint8 and uint64 for numbers, and for an array the address of the public fields of NumPy's object
(``data``, ``nd``, ``dimensions``, ``strides``), so that Python need not take it apart.
"""

import ctypes
import hashlib
import json
import platform
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.kept import PACKAGE
from birthsim_env.physics.compiled.named import Named
from birthsim_env.physics.compiled.sources import stamp_of
from birthsim_env.physics.compiled.switches import switched

if TYPE_CHECKING:
    from birthsim_env.physics.compiled.compilation import Kernel

FORMAT = 1
"""Of the folder. A library of another one is not read."""

USED = switched("BIRTHSIM_PREBUILT", True, "prebuilt machine code where there is some", "what Numba compiles")
"""Whether prebuilt code is looked for."""

LANES = 32
"""In a block of prebuilt code."""

FOLDER = PACKAGE / "prebuilt"
ENDINGS = {"linux": "so", "darwin": "dylib", "win32": "dll"}
_MACHINES = {"x86_64": "x86-64", "AMD64": "x86-64", "aarch64": "aarch64", "arm64": "aarch64"}
_LEVELS = {"v4": ("AVX512_SKX",), "v3": ("AVX2", "FMA3", "F16C")}
"""Of x86-64, the highest first -> what NumPy calls that a processor has. With AVX-512 there are twice as many registers."""


_NUMBERS = {int: "i", np.int64: "i", float: "d", np.float64: "d", bool: "b", np.bool_: "b", np.uint64: "u"}
_PASSED = {"i": ctypes.c_int64, "d": ctypes.c_double, "b": ctypes.c_bool, "u": ctypes.c_uint64}
_HEAD = object.__basicsize__
"""Bytes of a Python object before its own fields, which in an array are NumPy's."""

_C, _F, _ALIGNED, _WRITEABLE = 0x1, 0x2, 0x100, 0x400
"""Of the flags of an array."""


def target() -> str:
    """The library's file for this machine, whether or not it is there; empty where none can be."""
    machine = _MACHINES.get(platform.machine(), "")
    if machine == "x86-64":
        levels = (level for level, needed in _LEVELS.items() if all(_features().get(one) for one in needed))
        machine = next((f"{machine}-{level}" for level in levels), "")
    return f"{machine}.{ENDINGS[sys.platform]}" if machine and sys.platform in ENDINGS else ""


def _features() -> dict[str, bool]:
    """What this processor has, as NumPy found it."""
    found: dict[str, bool] = (np._core if hasattr(np, "_core") else np.core)._multiarray_umath.__cpu_features__
    return found


@cache
def _opened() -> tuple[Any, dict[str, list[Any]]]:
    """The library for this machine and its kernels; nothing where it is missing, damaged, another's, or switched off."""
    nothing = None, dict[str, list[Any]]()
    if not USED or BLOCK != LANES or not _arrays_are_as_known():
        return nothing
    try:
        index, file = json.loads((FOLDER / "index.json").read_bytes()), target()
        if index["format"] != FORMAT or hashlib.sha256((FOLDER / file).read_bytes()).hexdigest() != index["libraries"][file]:
            return nothing
        return ctypes.CDLL(str(FOLDER / file)), index["kernels"]
    except (OSError, ValueError, KeyError, TypeError):
        return nothing


def described() -> str:
    """What is there for this machine, in words."""
    library, kernels = _opened()
    return (
        f"{len(kernels)} kernels in {FOLDER / target()}"
        if library
        else "none: Numba compiles kernels when they are first called"
    )


def _arrays_are_as_known() -> bool:
    """Whether an array's fields stand where prebuilt code reads them."""
    array = np.zeros((2, 3))[:, 1:]
    data, axes, shape, strides = (ctypes.c_int64 * 4).from_address(id(array) + _HEAD)
    if axes & 0xFFFFFFFF != 2 or data != array.ctypes.data:
        return False
    return (ctypes.c_int64 * 2).from_address(shape)[:] == [2, 2] and (ctypes.c_int64 * 2).from_address(strides)[:] == [24, 8]


def kind_of(value: Any) -> Any:
    """The kind of an argument, quickly; ``code_of`` names it."""
    if type(value) is np.ndarray:
        return value.dtype, value.ndim, value.flags.num
    kind = type(value)
    return (kind, kind_of(value.rows)) if kind not in _NUMBERS and isinstance(value, Named) else kind


def code_of(kind: Any) -> str:
    """What a key has for a kind of arguments; ? where no prebuilt code takes one."""
    if not isinstance(kind, tuple):
        return _NUMBERS.get(kind, "?")
    if len(kind) == 2:
        return f"{kind[0].__module__}.{kind[0].__qualname__}:{code_of(kind[1]).replace('F', 'A')}"
    dtype, axes, flags = kind
    order = "C" if flags & _C else "F" if flags & _F else "A"
    known = dtype.isnative and flags & _ALIGNED
    return f"{dtype.char}{axes}{order}{'' if flags & _WRITEABLE else 'r'}" if known else "?"


def key_of(kernel: "Kernel", kinds: Iterable[str]) -> str:
    """What the index calls a kernel for arguments of these kinds."""
    function = kernel.py_func
    return " ".join((f"{function.__module__}.{function.__qualname__}", *kinds))


def symbol_of(key: str) -> str:
    """What a library calls it: the same whatever other kernels there are."""
    return f"birthsim_{hashlib.sha256(key.encode()).hexdigest()[:16]}"


def found(kernel: "Kernel", kinds: Sequence[str]) -> tuple[Any, str]:
    """The prebuilt code of a kernel for arguments of these kinds, and the kind of its result; None where there is none."""
    library, kernels = _opened()
    key = key_of(kernel, kinds)
    stamp, result = kernels.get(key, ("", ""))
    return (library[symbol_of(key)], result) if stamp and stamp == stamp_of(kernel.py_func) else (None, "")


def of_numbers(kernel: "Kernel", count: int) -> Any:
    """The prebuilt code of a kernel of ``count`` whole numbers that returns one; None where there is none."""
    native, _ = found(kernel, ["i"] * count)
    if native is not None:
        native.argtypes, native.restype = [ctypes.c_int64] * count, ctypes.c_int64
    return native


def address(kernel: "Kernel", count: int) -> int:
    """Where that code begins, or 0."""
    native = of_numbers(kernel, count)
    return 0 if native is None else int(ctypes.cast(native, ctypes.c_void_p).value or 0)


def function(kernel: "Kernel", kinds: tuple[Any, ...]) -> Callable[..., Any] | None:
    """What calls the prebuilt code of a kernel for arguments of these kinds; None where there is none."""
    codes = [code_of(kind) for kind in kinds]
    native, result = found(kernel, codes)
    if native is None:
        return None
    if {*codes, result} == {"i"}:
        return of_numbers(kernel, len(codes))  # type: ignore[no-any-return]
    native.argtypes = [ctypes.c_void_p, *(_PASSED.get(code, ctypes.c_int64) for code in codes)]
    native.restype = ctypes.c_int32
    # A loop over arguments would take as long as the call.
    names = [f"a{k}" for k in range(len(codes))]
    ways = {True: "{}", False: f"id({{}}) + {_HEAD}"}
    given = [ways[code in _PASSED].format(name + ".rows" * (":" in code)) for name, code in zip(names, codes, strict=True)]
    place, returned = ("None", "None") if result == "n" else ("byref(value := new())", "value.value")
    # Numba raises what prebuilt code cannot.
    call = f"numba({', '.join(names)}) if native({', '.join([place, *given])}) else {returned}"
    known = {"native": native, "numba": lambda *again: kernel.numba(*again), "byref": ctypes.byref, "new": _PASSED.get(result)}
    run: Callable[..., Any] = eval(f"lambda {', '.join(names)}: {call}", known)
    return run
