"""What a mutation tester may change in a module: one operator, number or function name at a time."""

from __future__ import annotations

import ast
import copy
import inspect
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from types import CodeType, ModuleType
from typing import Any

ARITHMETIC = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult}
BOUNDARY = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
OPPOSITE = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
NAMES = {"min": "max", "sin": "cos", "arcsin": "arccos", "argmin": "argmax", "all": "any"}
NAMES |= {after: before for before, after in NAMES.items()}
DROPPED = ("sqrt", "abs")
UNTOUCHED = ("annotation", "returns", "decorator_list")


@dataclass(frozen=True)
class Mutant:
    """One change. Its name says module, function, operator and the operator's number in the function."""

    name: str
    line: int
    change: str
    apply: Callable[[], None]


def alternatives(node: Any) -> Iterator[tuple[str, Any]]:
    """The changes of one node: name of the operator and new node."""
    changed = copy.copy(node)
    match node:
        case ast.BinOp(op=op) if type(op) in ARITHMETIC:
            changed.op = ARITHMETIC[type(op)]()
            yield "arithmetic", changed
        case ast.Compare(ops=ops):
            for name, table in (("boundary", BOUNDARY), ("opposite", OPPOSITE)):
                for k, comparison in enumerate(ops):
                    if type(comparison) in table:
                        changed = copy.copy(node)
                        changed.ops = [*ops[:k], table[type(comparison)](), *ops[k + 1 :]]
                        yield name, changed
        case ast.BoolOp(op=op):
            changed.op = ast.And() if isinstance(op, ast.Or) else ast.Or()
            yield "logic", changed
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            yield "unary", operand
        case ast.IfExp():
            changed.body, changed.orelse = node.orelse, node.body
            yield "ternary", changed
        case ast.Constant(value=bool(value)):
            changed.value = not value
            yield "constant", changed
        case ast.Constant(value=int(value)):
            changed.value = value + 1
            yield "constant", changed
        case ast.Constant(value=float(value)):
            changed.value = value * 1.1 or 0.1
            yield "constant", changed
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)):
            if name in NAMES:
                changed.func = copy.copy(node.func)
                setattr(changed.func, "id" if isinstance(node.func, ast.Name) else "attr", NAMES[name])
                yield "function", changed
            elif name in DROPPED:
                yield "call", node.args[0]


def sites(node: ast.AST) -> Iterator[tuple[Any, Any, int | str]]:
    """Every node below ``node`` in the order of the text, with the list or dictionary that holds it and its key there."""
    for field, value in ast.iter_fields(node):
        if field not in UNTOUCHED:
            holder: Any = value if isinstance(value, list) else vars(node)
            keys: Iterable[int | str] = range(len(value)) if holder is value else [field]
            for key in keys:
                if isinstance(child := holder[key], ast.AST):
                    yield child, holder, key
                    yield from sites(child)


def essence(code: CodeType) -> tuple[object, ...]:
    """What a code object does, whatever its lines."""
    constants = tuple(essence(c) if isinstance(c, CodeType) else repr(c) for c in code.co_consts)
    return code.co_code, code.co_names, code.co_varnames, constants


def compiled(function: ast.FunctionDef, path: str) -> CodeType:
    """The code object of a function without its decorators."""
    bare = copy.copy(function)
    bare.decorator_list = []
    everything = compile(ast.Module([bare], []), path, "exec", flags=annotations.compiler_flag, dont_inherit=True)
    return next(c for c in everything.co_consts if isinstance(c, CodeType) and c.co_name == function.name)


def function_mutants(module: ModuleType, function: ast.FunctionDef) -> Iterator[Mutant]:
    """The mutants of a function whose code differs."""
    target, counts, path = inspect.unwrap(getattr(module, function.name)), Counter[str](), str(module.__file__)
    seen = {essence(compiled(function, path))}
    for node, holder, key in sites(function):
        for operator, new in alternatives(node):
            holder[key] = new
            code = compiled(function, path)
            holder[key] = node
            counts[operator] += 1
            if essence(code) not in seen:
                seen.add(essence(code))
                name = f"{module.__name__}:{function.name}:{operator}:{counts[operator]}"
                change = f"{ast.unparse(node)}  ->  {ast.unparse(new)}"
                yield Mutant(name, node.lineno, change, partial(setattr, target, "__code__", code))


def mutants_of(module: ModuleType) -> Iterator[Mutant]:
    """All mutants of a module: of its functions, and of its constants that are plain numbers."""
    for node in ast.parse(inspect.getsource(module)).body:
        match node:
            case ast.FunctionDef():
                yield from function_mutants(module, node)
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Constant(value=int() | float()) as old):
                [(operator, new)] = alternatives(old)
                change = f"{name} = {old.value!r}  ->  {new.value!r}"
                apply = partial(setattr, module, name, new.value)
                yield Mutant(f"{module.__name__}:{name}:{operator}:1", node.lineno, change, apply)
