"""The public names of a package, with their docstrings, as MyST's directives of Python objects."""

import ast
import dataclasses
import inspect
import re
import textwrap
from importlib import import_module

import birthsim
from _generate import docstrings
from _generate.sentences import first_sentence

BEYOND = {
    "birthsim": (),
    "birthsim_env": (
        "env.BirthSIMEnv",
        "vector_env.BirthSIMVectorEnv",
        "parts.actuation.Actuation",
    ),
    "baselines": (
        "staged.StagedController",
        "staged.ControllerStage",
        "bench.evaluation.table",
        "rivals.symbolic.symbolic_model",
        "rivals.symbolic.SymbolicModel",
    ),
    "agents": (),
}
"""Package -> names that pages speak of, beside those in its ``__all__``."""


SUBJECTS = {
    "environments": ("birthsim.envs", "birthsim.names", "birthsim_env.registry", "birthsim_env.scores"),
    "scenarios": ("birthsim_env.parts",),
    "rig": ("birthsim_env.physics",),
    "linear": ("birthsim_env.gradients",),
    "controllers": ("baselines.controller", "baselines.named", "baselines.staged", "birthsim_env.loop"),
    "evaluation": ("baselines.bench", "birthsim.benchmark"),
    "logs": ("baselines.identification", "birthsim.identification"),
    "learning": ("agents", "birthsim.exporting", "birthsim.training"),
}
"""Page of the package ``birthsim`` -> modules of which it documents the names."""


class _Bare(str):
    """An annotation, printed without quotes."""

    __repr__ = str.__str__


def api(package: str) -> str:
    """A directive for every public name of a package, in alphabetical order; what the front door has too stands there alone."""
    known = _known(package)
    own = {name: known[name] for name in sorted(known) if known[name][0].startswith(f"{package}.")}
    return "\n\n".join([_index(package, known), *(_entry(*one) for one in own.values())])


def front() -> str:
    """The names of ``birthsim``, which are documented on a page for each subject."""
    return _index("birthsim", _known("birthsim"))


def subject(name: str) -> str:
    """A directive for every name of ``birthsim`` that belongs to one of ``SUBJECTS``."""
    return "\n\n".join(_entry(*one) for _, one in sorted(_known("birthsim").items()) if _subject(one[1]) == name)


def _subject(thing: object) -> str:
    found = [name for name, places in SUBJECTS.items() if any(f"{thing.__module__}.".startswith(f"{one}.") for one in places)]
    if len(found) != 1:
        raise ValueError(f"{thing.__module__} = module of a name of birthsim has subjects {found}; allowed: one of SUBJECTS")
    return found[0]


def _known(package: str) -> dict[str, tuple[str, object]]:
    """Name -> (where it is documented, what it is), of a package's ``__all__`` and of ``BEYOND``."""
    module = import_module(package)
    known = {name: (f"{package}.{name}", getattr(module, name)) for name in module.__all__}
    for dotted in BEYOND[package]:
        place, _, name = dotted.rpartition(".")
        known[name] = (f"{package}.{dotted}", getattr(import_module(f"{package}.{place}"), name))
    for name, (_, thing) in known.items():
        if name in birthsim.__all__ and thing is getattr(birthsim, name):
            known[name] = f"birthsim.{name}", thing
    return known


def _index(package: str, known: dict[str, tuple[str, object]]) -> str:
    """What a package says of itself, and a line for each name; one that another page documents has its place here too."""
    lines = []
    for _, (dotted, thing) in sorted(known.items()):
        place = f'<span id="{dotted}"></span>' if package == "birthsim" else ""
        lines.append(f"- {place}{{py:obj}}`{dotted}`: {_first(thing)}")
    return f"{inspect.getdoc(import_module(package)) or ''}\n\n" + "\n".join(lines)


def _entry(dotted: str, thing: object) -> str:
    kind = "class" if inspect.isclass(thing) else "function"
    inside = [_text(thing)]
    if inspect.isclass(thing):
        inside += [_member(name, member) for name, member in vars(thing).items() if not name.startswith("_")]
    title = f"## `{dotted.rpartition('.')[2]}`"
    return f"{title}\n\n::::{{py:{kind}}} {dotted}{_signature(thing)}\n" + "\n\n".join(filter(None, inside)) + "\n::::"


def _member(name: str, member: object) -> str:
    """The directive of a documented method or property; nothing for what a base class documents."""
    inner = getattr(member, "fget", None) or getattr(member, "__func__", member)
    if not inspect.isfunction(inner) or not inspect.getdoc(inner):
        return ""
    if isinstance(member, property):
        return f":::{{py:property}} {name}\n{_text(inner)}\n:::"
    option = "\n:classmethod:\n" if isinstance(member, classmethod) else ""
    return f":::{{py:method}} {name}{_signature(inner, bound=True)}{option}\n{_text(inner)}\n:::"


def _signature(thing: object, bound: bool = False) -> str:
    try:
        signature = inspect.signature(thing)
    except ValueError:
        return "()"
    written = _annotations(thing)
    given = [_shown(one, written) for one in signature.parameters.values()][int(bound) :]
    returned = signature.empty if inspect.isclass(thing) else written.get("return", signature.empty)
    return str(signature.replace(parameters=given, return_annotation=returned))


def _shown(one: inspect.Parameter, written: dict[str, _Bare]) -> inspect.Parameter:
    # A default that is an object of ours says more by its class than by its address; one that a factory makes has none.
    simple = one.default is one.empty or isinstance(one.default, (bool, int, float, str, tuple, type(None)))
    made = type(one.default).__module__ == "dataclasses"
    default = one.default if simple else _Bare("..." if made else f"{type(one.default).__name__}(...)")
    return one.replace(annotation=written.get(one.name, one.empty), default=default)


def _annotations(thing: object) -> dict[str, _Bare]:
    """The annotations of a function, of a class's ``__init__``, or of its fields, as their source has them."""
    found = {}
    for one in reversed(inspect.getmro(thing)[:-1]) if inspect.isclass(thing) else [thing]:
        try:
            (tree,) = ast.parse(textwrap.dedent(inspect.getsource(one))).body
        except (OSError, TypeError):  # none of Python's
            continue
        inside = tree.body if inspect.isclass(one) else [tree]
        for node in inside:
            if isinstance(node, ast.FunctionDef) and (not inspect.isclass(one) or node.name == "__init__"):
                given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
                found |= {own.arg: _Bare(ast.unparse(own.annotation)) for own in given if own and own.annotation}
                if packed := re.fullmatch(r"Unpack\[(\w+)\]", found.get(node.args.kwarg.arg, "") if node.args.kwarg else ""):
                    found |= _annotations(getattr(import_module(one.__module__), packed[1]))
                found |= {"return": _Bare(ast.unparse(node.returns))} if node.returns else {}
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                found[node.target.id] = _Bare(ast.unparse(node.annotation))
    return found


def _text(thing: object) -> str:
    """The docstring as Markdown: its headings become bold lines, since a page has one order of headings."""
    if dataclasses.is_dataclass(thing) and (thing.__doc__ or "").startswith(f"{getattr(thing, '__name__', '')}("):
        return ""
    if docstrings.read(thing).sections:
        return docstrings.markdown(thing)
    text, _, listed = (inspect.getdoc(thing) or "").partition("\nArguments:\n")
    if listed:
        # A block of arguments becomes a list; what stands further in belongs to the argument above it.
        text += "\nArguments:\n\n" + re.sub(r"^    (\w+): ", r"- ``\1``: ", listed, flags=re.MULTILINE)
    return re.sub(r"^#+ (.*)$", r"**\1**\n", text, flags=re.MULTILINE)


def _first(thing: object) -> str:
    """The first sentence of a docstring."""
    return first_sentence(" ".join((inspect.getdoc(thing) or "").split()))
