"""Writes a graph as kernels: one loop over lanes, one statement an operation, which LLVM vectorises."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import tempfile
from collections.abc import Callable, Iterable
from functools import cache, cached_property
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from birthsim_env.files import write_text
from birthsim_env.gradients.graph import Graph, Scalar, Value
from birthsim_env.physics.compiled.compilation import Late
from birthsim_env.physics.compiled.kept import cache_folder
from birthsim_env.physics.compiled.plain import DEBUG

if DEBUG:

    def choose(condition: bool, yes: float, no: float) -> float:
        """``yes if condition else no`` of numbers that are at hand, as ``intrinsics`` has it for machine code."""
        return yes if condition else no

elif TYPE_CHECKING:
    from birthsim_env.gradients.intrinsics import choose as choose
else:
    choose = Late("birthsim_env.gradients.intrinsics", "choose")


class Straight:
    """A function of arrays and a lane without a branch, which kernels call: what it is for Numba is made when one asks."""

    def __init__(self, function: Callable[..., None]) -> None:
        self._function = function

    @cached_property
    def _numba_type_(self) -> Any:
        from birthsim_env.gradients import instructions  # late: code that is there already needs none of it

        return instructions.type_of(self._function)


def straight(function: Callable[..., None]) -> Any:
    """Have each statement of a function made into instructions by itself; with ``BIRTHSIM_DEBUG=1`` it stays plain Python."""
    return function if DEBUG else Straight(function)


HEAD = '''"""Generated: derivatives of kernels."""

import math

import numpy as np

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.gradients.source import choose, straight
'''

_INFIX = {
    **{sign: sign for sign in ["+", "-", "*", "/", "%", "^", ">>", "<", ">", "<=", ">=", "==", "!="]},
    "and": "&",
    "or": "|",
}
_CALLS = {
    "where": "choose", "sqrt": "math.sqrt", "copysign": "math.copysign", "isfinite": "math.isfinite", "floor": "np.floor",
    **{name: f"exact.{name}" for name in ("exp", "exp2", "log", "log1p", "tanh", "sine", "cosine", "rounded")},
    **{name: name for name in ("abs", "max", "min", "int")}, "neg": "-", "not": "not ", "uint": "np.uint64",
}  # fmt: skip

Output = tuple[str, int, Scalar]
"""An array, its row and what is written there."""


def _name(value: Any) -> str:
    if isinstance(value, Value):
        return f"t{value.at}"
    return repr(value) if repr(value) not in ("inf", "-inf", "nan") else f"math.{value}".replace("math.-", "-math.")


def _statement(graph: Graph, k: int) -> str:
    operation, *arguments = graph.nodes[k]
    if operation == "input":
        return f"{arguments[0]}[{arguments[1]}, i]"
    names = [_name(value) for value in arguments]
    if operation == "bits":
        return f"np.float64({names[0]}).view(np.uint64)"
    if operation in _INFIX:
        return f"{names[0]} {_INFIX[operation]} {names[1]}"
    return f"{_CALLS[operation]}({', '.join(names)})"


def loop(graph: Graph, name: str, arrays: Iterable[str], outputs: Iterable[Output]) -> str:
    """A helper ``name(*arrays, n)`` over n lanes that writes ``outputs``, with the operations that they need, each where it is
    first needed."""
    outputs, written, order = list(outputs), set[int](), list[int]()
    for _, _, output in outputs:
        stack = [(output, False)]
        while stack:
            value, ready = stack.pop()
            if not isinstance(value, Value) or value.at in written:
                continue
            if ready:
                written.add(value.at)
                order.append(value.at)
            else:
                stack.append((value, True))
                stack += [(a, False) for a in reversed(graph.nodes[value.at][1:]) if isinstance(a, Value)]
    given = ", ".join(arrays)
    lines = ["@straight", f"def {name}_lane({given}, i):"]
    lines += [f"    t{k} = {_statement(graph, k)}" for k in order]
    lines += [f"    {array}[{row}, i] = {_name(v if isinstance(v, Value) else float(v))}" for array, row, v in outputs]
    lines += [] if outputs else ["    pass"]
    # Unsigned, so that no check for a negative index remains, at which LLVM would give up vectorising.
    lines += ["", "", "@helper", f"def {name}({given}, n):", "    for lane in range(n):"]
    lines += [f"        {name}_lane({given}, np.uint64(lane))"]
    return "\n".join([*lines, ""])


TEXTS: dict[str, str] = {}
"""Name -> source of the modules that ``module_of`` has made."""


@cache
def module_of(text: str) -> ModuleType:
    """A module of generated source, kept beside the machine code of kernels under the hash of its text.

    The hash is part of the module's name, and the text is a file that kernels are made from: so both are part of what names
    their machine code. It is no ``.py``: nobody wrote it, and what looks at the project's sources need not.
    """
    name = f"gradients_{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    folder = cache_folder() or Path(tempfile.mkdtemp())
    path = folder / f"{name}.source"
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        write_text(path, text)
    spec = importlib.util.spec_from_file_location(name, path, loader=SourceFileLoader(name, str(path)))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name], TEXTS[name] = module, text
    spec.loader.exec_module(module)
    return module
