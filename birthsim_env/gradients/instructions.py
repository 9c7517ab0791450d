"""Straight code as instructions: a function of thousands of statements without a branch, which Numba need not analyse.

Most of what Numba does with a function is for control flow and for types that statements leave open. A statement of generated
code has neither, so that each goes to LLVM by itself, by the operation that Numba has for its arguments: a third of the time,
and the same bits.
"""

import ast
import builtins
import inspect
import operator
from collections.abc import Callable
from typing import Any

from numba import types
from numba.core import cgutils as _cgutils
from numba.core.registry import cpu_target
from numba.extending import intrinsic
from numba.np import arrayobj as _arrayobj

_SIGNS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Mod: operator.mod,
    ast.BitXor: operator.xor, ast.RShift: operator.rshift, ast.BitAnd: operator.and_, ast.BitOr: operator.or_,
    ast.Lt: operator.lt, ast.Gt: operator.gt, ast.LtE: operator.le, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne, ast.USub: operator.neg, ast.Not: operator.not_,
}  # fmt: skip
_NUMBERS = {bool: types.boolean, int: types.intp, float: types.float64}

cgutils: Any = _cgutils
arrayobj: Any = _arrayobj

Typed = tuple[Any, Any]
"""LLVM's value and its type."""


class _Written:
    """Instructions of one function: ``known`` are its arguments, and then what its statements name."""

    def __init__(self, context: Any, builder: Any, known: dict[str, Typed], names: dict[str, Any]) -> None:
        self._context, self._builder, self._known, self._names = context, builder, known, names
        self._operations: dict[Any, tuple[Any, Any]] = {}
        self._arrays = {
            name: context.make_array(kind)(context, builder, value)
            for name, (value, kind) in known.items()
            if isinstance(kind, types.Array)
        }

    def statement(self, line: ast.Assign) -> None:
        """``name = ...`` or ``array[row, lane] = ...``."""
        (target,), (value, kind) = line.targets, self._of(line.value)
        if isinstance(target, ast.Name):
            self._known[target.id] = value, kind
            return
        array, place = self._place(target)
        value = self._context.cast(self._builder, value, kind, array.dtype)
        arrayobj.store_item(self._context, self._builder, array, value, place)

    def _place(self, target: Any) -> tuple[Any, Any]:
        name, indices = target.value.id, [self._of(index)[0] for index in target.slice.elts]
        array = self._known[name][1]
        return array, cgutils.get_item_pointer(self._context, self._builder, array, self._arrays[name], indices)

    def _of(self, node: Any) -> Typed:
        match node:
            case ast.Name() if node.id in self._known:
                return self._known[node.id]
            case ast.Name() | ast.Attribute():
                return self._number(self._meant(node))
            case ast.Constant():
                return self._number(node.value)
            case ast.Subscript():
                array, place = self._place(node)
                return arrayobj.load_item(self._context, self._builder, array, place), array.dtype
            case ast.BinOp():
                return self._operated(_SIGNS[type(node.op)], node.left, node.right)
            case ast.Compare():
                return self._operated(_SIGNS[type(node.ops[0])], node.left, node.comparators[0])
            case ast.UnaryOp():
                return self._operated(_SIGNS[type(node.op)], node.operand)
            case ast.Call(func=ast.Attribute(value=number, attr="view")):  # its bits
                return self._builder.bitcast(self._of(number)[0], cgutils.intp_t), types.uint64
            case ast.Call(func=ast.Attribute(attr="uint64" | "float64" as name)):
                value, kind = self._of(node.args[0])
                wanted = getattr(types, name)
                return self._context.cast(self._builder, value, kind, wanted), wanted
        return self._operated(self._meant(node.func), *node.args)

    def _meant(self, node: Any) -> Any:
        """What a name of the module stands for, or an attribute of one."""
        return self._names[node.id] if isinstance(node, ast.Name) else getattr(self._names[node.value.id], node.attr)

    def _number(self, value: Any) -> Typed:
        kind = _NUMBERS[type(value)]
        return self._context.get_constant(kind, value), kind

    def _operated(self, function: Any, *nodes: ast.expr) -> Typed:
        values, kinds = zip(*map(self._of, nodes), strict=True)
        if (function, kinds) not in self._operations:
            typing = self._context.typing_context
            kind = typing.resolve_value_type(function)
            signature = kind.get_call_type(typing, kinds, {})
            self._operations[function, kinds] = signature, self._context.get_function(kind, signature)
        signature, instructions = self._operations[function, kinds]
        wanted = signature.args
        starred = isinstance(wanted[0], (types.StarArgTuple, types.StarArgUniTuple))  # max(*args)
        each = tuple(wanted[0]) if starred else wanted
        given = [self._context.cast(self._builder, *one) for one in zip(values, kinds, each, strict=True)]
        given = [self._context.make_tuple(self._builder, wanted[0], given)] if starred else given
        return instructions(self._builder, given), signature.return_type


def type_of(function: Callable[..., Any]) -> Any:
    """The type of ``source.Straight``'s function for kernels that call it: they take its instructions in."""

    def instructions(typing: Any, *kinds: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            (definition,) = ast.parse(inspect.getsource(function)).body
            known = dict(zip(inspect.signature(function).parameters, zip(arguments, signature.args, strict=True), strict=True))
            written = _Written(context, builder, known, {**vars(builtins), **function.__globals__})
            for line in definition.body:  # type: ignore[attr-defined]
                if isinstance(line, ast.Assign):
                    written.statement(line)
            return context.get_dummy_value()

        return types.void(*kinds), generate

    instructions.__name__, own = function.__name__, inspect.signature(function)
    typing = inspect.Parameter("typing", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    instructions.__signature__ = own.replace(parameters=[typing, *own.parameters.values()])  # type: ignore[attr-defined]
    made, context = intrinsic(instructions), cpu_target.typing_context
    context.refresh()
    return context.resolve_value_type(made)
