"""Kernels as plain Python, where ``BIRTHSIM_DEBUG=1`` is set: a debugger enters them, and every bit is that of machine code.

    BIRTHSIM_DEBUG=1 python -m pdb my_script.py

Elements of NumPy's arrays are numbers of the same IEEE arithmetic as machine code's. Where Python differs it is made alike: no
operation on numbers fails or warns, ``math`` gives kernels NumPy's numbers, of which a division by zero is infinite, and a
power with a whole number is the product that Numba makes of it.
"""

import ast
import dis
import inspect
import math
import textwrap
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from birthsim_env.physics.compiled.switches import switched

F = TypeVar("F", bound=Callable[..., Any])

DEBUG = switched("BIRTHSIM_DEBUG", False, "plain Python", "machine code")
"""Whether kernels stay plain Python."""

NO_NUMBER = -(2**63)
"""What a processor makes of the floor of what is not finite."""


class _Math:
    """``math`` as machine code has it: for numbers out of a function's domain NaN instead of an error."""

    def __getattr__(self, name: str) -> Any:
        return getattr(math, name)

    @staticmethod
    def sqrt(x: Any) -> Any:
        return np.sqrt(np.float64(x))

    @staticmethod
    def copysign(size: Any, sign: Any) -> Any:
        return np.copysign(np.float64(size), sign)

    @staticmethod
    def floor(x: Any) -> int:
        return math.floor(x) if math.isfinite(x) else NO_NUMBER


_MATH = _Math()
REAL: dict[Any, Any] = {_MATH.sqrt: math.sqrt, _MATH.copysign: math.copysign, _MATH.floor: math.floor}
"""What stands in plain kernels for a function of ``math`` -> that function."""

if DEBUG:
    np.seterr(all="ignore")


def power(base: Any, exponent: int) -> Any:
    """``base`` to a whole number, rounded as Numba's product of it."""
    square, product, left = base, None, abs(exponent)
    while left:
        if left & 1:
            product = square if product is None else product * square
        square, left = square * square, left >> 1
    whole = 1.0 if product is None else product
    return 1.0 / whole if exponent < 0 else whole


class _Powers(ast.NodeTransformer):
    """Writes ``power(base, 3)`` for ``base**3``."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        whole = isinstance(node.right, ast.Constant) and isinstance(node.right.value, int)
        if not (whole and isinstance(node.op, ast.Pow)):
            return node
        return ast.copy_location(ast.Call(ast.Name("_birthsim_power", ast.Load()), [node.left, node.right], []), node)


def _with_powers(function: F) -> F:
    """The function with its powers as products, on the same lines of the same file."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    ast.increment_lineno(tree, function.__code__.co_firstlineno - 1)
    (definition,) = tree.body
    definition.decorator_list = []  # type: ignore[attr-defined]
    code = compile(ast.fix_missing_locations(_Powers().visit(tree)), function.__code__.co_filename, "exec")
    function.__globals__["_birthsim_power"], made = power, dict[str, Any]()
    exec(code, function.__globals__, made)
    found: F = made[function.__name__]
    return found


def plain(function: F) -> F:
    """A kernel that stays Python, which is its own ``py_func``; its module's ``math`` is that of machine code."""
    if function.__globals__.get("math") is math:
        function.__globals__["math"] = _MATH
    if function.__closure__ is None and any(one.argrepr == "**" for one in dis.get_instructions(function)):
        function = _with_powers(function)
    function.py_func = function  # type: ignore[attr-defined]
    return function
