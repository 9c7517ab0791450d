"""What a source file of this project defines at its top level, and what each definition refers to. Nothing is run.

A definition is a function, a class, or a constant with every statement that gives it a value. Comments, layout and docstrings
are no code. What a file runs when it is imported, beside definitions, is one more, ``ON_IMPORT``; a call of the registry's
``register`` is a definition of its own, since it changes nothing for those who do not ask for its entry.
"""

import ast
import hashlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from birthsim_env import registry
from birthsim_env.physics.compiled import sources
from birthsim_env.physics.compiled.sources import is_ours, is_prose, remembered, walk

ON_IMPORT = "<import>"
"""The definition that is what a file runs when it is imported."""

MAKES, REGISTERS = "gymnasium.make", "gymnasium.register"
"""What a reference to Gymnasium's functions counts as, which make environments by id and register ids."""

_REGISTER = f"{registry.__name__}.register"
_NAMED = re.compile(r"([A-Za-z_]\w*(?:\.\w+)+)(?::(\w+))?")
"""A string that may name a module, or a definition as in "package.module:name"."""

_GENERATED = re.compile(r"^ *from ([\w.]+) import (\w[\w ,]*)", re.MULTILINE)
"""An import in a string, which is source that is yet to be run."""


class Definition(NamedTuple):
    """A definition's code, as a hash, and what it refers to.

    ``own`` names definitions of the same file. ``others`` are dotted names of this project's modules and of what stands in
    them, and ``MAKES`` and ``REGISTERS``. ``named`` are modules, or module:name, in strings.
    """

    code: str
    own: list[str]
    others: list[str]
    named: list[str]


class Definitions(NamedTuple):
    """Those of a file by name, what its imports of this project's modules are called there, and, by "kind=name", which
    definition registers an entry; one whose name only a run tells is called "kind=*"."""

    defined: dict[str, Definition]
    imported: dict[str, str]
    entries: dict[str, str]


@cache
def definitions(path: Path) -> Definitions:
    """What a file defines, as this process finds it at first."""
    readers = Path(__file__), Path(sources.__file__)
    defined, imported, entries = remembered(path, _content(path), "definitions", _read, *readers)
    return Definitions({name: Definition(*one) for name, one in defined.items()}, imported, entries)


@cache
def _content(path: Path) -> bytes:
    return path.read_bytes()


@cache
def take_stock() -> None:
    """Hold the content of all files, so that what is edited while work goes on is not taken for what worked."""
    for path in sources.files_of(*sources.PACKAGES):
        _content(path)


def _read(content: bytes) -> Definitions:
    """Sort the statements of a file by what they define, then look for names in each group."""
    statements: dict[str, list[ast.stmt]] = {}
    imported: dict[str, str] = {}
    on_import, entries = list[ast.stmt](), dict[str, str]()
    loaded, handed_over = list[str](), list[str]()
    for statement in ast.parse(content).body:
        if is_prose(statement) or _is_script(statement):
            continue
        imported |= {alias: name for alias, name in _imports(statement) if alias not in imported}
        loaded += [name.name for name in statement.names if is_ours(name.name)] if isinstance(statement, ast.Import) else []
        names = list(_bound(statement))
        registered = list(_registered(statement, imported))
        if _runs(statement) and registered:
            names.insert(0, registered[0])
        elif _runs(statement):
            on_import.append(statement)
        handed_over += names if _is_handed_over(statement, imported) else []
        entries |= {entry: names[0] for entry in registered}
        for name in names:
            statements.setdefault(name, []).append(statement)
    if on_import or loaded or handed_over:
        statements[ON_IMPORT] = on_import
    defined = {name: _definition(group, imported, set(statements)) for name, group in statements.items()}
    if ON_IMPORT in defined:
        one = defined[ON_IMPORT]
        # ``import package.module`` may be there for what that module runs.
        others = sorted({*one.others, *(f"{name}.{ON_IMPORT}" for name in loaded)})
        defined[ON_IMPORT] = one._replace(own=sorted({*one.own, *handed_over}), others=others)
    return Definitions(defined, {alias: name for alias, name in imported.items() if _counts(name)}, entries)


def _definition(group: list[ast.stmt], imported: dict[str, str], defined: set[str]) -> Definition:
    digest, named = hashlib.sha256(), set[str]()
    for one, said in walk(list(group)):
        digest.update(f"{said}\n".encode())
        text = _text(one)
        if (found := _NAMED.fullmatch(text)) and is_ours(found[1]):
            named.add(text)
        for module, names in _GENERATED.findall(text):
            named |= {f"{module}:{name.split()[0]}" for name in names.split(",") if is_ours(module)}
    late = {alias: name for statement in group for one in _code(statement) for alias, name in _imports(one)}
    own, others = set[str](), set[str]()
    for statement in group:
        for name in _dotted(statement):
            root, dot, rest = name.partition(".")
            if root in late or root in imported:
                others.add({**imported, **late}[root] + dot + rest)
            if root in defined:
                own.add(root)
    known = {counted for name in others if (counted := _counts(name))}
    return Definition(digest.hexdigest(), sorted(own), sorted(known), sorted(named))


def _text(node: object) -> str:
    """The text of a node that is a literal one, or ""."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def _counts(name: str) -> str:
    """What a dotted name counts as: itself if it is this project's, a function of Gymnasium's, or nothing."""
    if is_ours(name):
        return name
    called = {"make": MAKES, "make_vec": MAKES, "register": REGISTERS}
    return called.get(name.rpartition(".")[2], "") if name.startswith("gymnasium.") else ""


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """A node and those below it, without annotations of functions and variables, which decide nothing; fields' may."""
    waiting: list[tuple[ast.AST, bool]] = [(node, False)]
    while waiting:
        one, in_class = waiting.pop()
        yield one
        for name, value in ast.iter_fields(one):
            if name in ("annotation", "returns") and not in_class:
                continue
            inside = isinstance(one, ast.ClassDef) and name == "body"
            for part in value if isinstance(value, list) else [value]:
                if isinstance(part, ast.AST):
                    waiting.append((part, inside and isinstance(part, ast.AnnAssign)))


def _dotted(statement: ast.AST) -> Iterator[str]:
    """Names that a statement refers to, with the attributes that follow them: "np.linalg.inv"."""
    inner = set[int]()
    for one in _code(statement):
        if isinstance(one, ast.Global):
            yield from one.names
        words = list[str]()
        while isinstance(one, ast.Attribute) and id(one) not in inner:
            inner.add(id(one.value))
            words.append(one.attr)
            one = one.value
        if isinstance(one, ast.Name) and (words or id(one) not in inner) and (words or isinstance(one.ctx, ast.Load)):
            yield ".".join([one.id, *reversed(words)])


def _imports(statement: ast.AST) -> Iterator[tuple[str, str]]:
    """What a statement, or what stands in it at the top level, imports: as what, and its dotted name."""
    for one in ast.walk(statement) if isinstance(statement, ast.If | ast.Try) else [statement]:
        if isinstance(one, ast.Import):
            for name in one.names:
                first = name.name.partition(".")[0]
                yield (name.asname, name.name) if name.asname else (first, first)
        elif isinstance(one, ast.ImportFrom) and one.module:
            yield from ((name.asname or name.name, f"{one.module}.{name.name}") for name in one.names)


def _bound(statement: ast.AST) -> Iterator[str]:
    """The names that a statement at the top level gives a value."""
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        yield statement.name
        return
    for one in ast.iter_child_nodes(statement):
        if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store):
            yield one.id
        elif isinstance(one, ast.stmt | ast.Tuple | ast.List | ast.Starred | ast.ExceptHandler | ast.withitem):
            yield from _bound(one)


def _registered(statement: ast.AST, imported: dict[str, str]) -> Iterator[str]:
    """The entries, "kind=name", that calls of ``register`` in a statement make."""
    for one in ast.walk(statement):
        if isinstance(one, ast.Call) and isinstance(one.func, ast.Name | ast.Attribute):
            root, dot, rest = next(_dotted(one.func), "").partition(".")
            if imported.get(root, "") + dot + rest == _REGISTER:
                kinds = [word for word in one.keywords if word.arg in registry.ROOMS]
                yield from (f"{word.arg}={_text(word.value) or '*'}" for word in kinds)


def _is_handed_over(statement: ast.stmt, imported: dict[str, str]) -> bool:
    """Whether a decorator hands what it stands above to Numba's compiler, which calls it by the types that it meets."""
    decorators = getattr(statement, "decorator_list", [])
    called = [one.func if isinstance(one, ast.Call) else one for one in decorators]
    roots = (next(_dotted(one), "").partition(".")[0] for one in called)
    return any(imported.get(root, "").startswith(("numba.core.", "numba.extending.")) for root in roots)


def _is_script(statement: ast.stmt) -> bool:
    """Whether a statement is ``if __name__ == "__main__"``."""
    return isinstance(statement, ast.If) and any(
        isinstance(one, ast.Name) and one.id == "__name__" for one in ast.walk(statement.test)
    )


def _runs(statement: ast.stmt) -> bool:
    """Whether a statement does more than to import, to define and to give names a value."""
    if isinstance(statement, ast.If | ast.Try):
        parts = list(ast.iter_child_nodes(statement))
        parts += [one for part in parts if isinstance(part, ast.ExceptHandler) for one in part.body]
        return any(_runs(one) for one in parts if isinstance(one, ast.stmt) and not is_prose(one))
    if isinstance(statement, ast.Assign | ast.AnnAssign | ast.AugAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        return any(isinstance(one, ast.Attribute | ast.Subscript) for target in targets for one in _targets(target))
    kept = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Import | ast.ImportFrom | ast.Pass | ast.Raise
    return not isinstance(statement, kept)


def _targets(target: ast.expr) -> Iterator[ast.expr]:
    """The single targets of an assignment."""
    if isinstance(target, ast.Tuple | ast.List):
        for one in target.elts:
            yield from _targets(one)
    else:
        yield target
