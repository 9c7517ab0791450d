"""``birthsim study NAME``: what the project measures of itself and of its controllers; it comes with a clone.

A study registers itself in its own file. To list studies, and to find the one that is asked for, calls of ``register`` are read
from the files below ``lab/studies`` without importing these, which would take seconds.
"""

import ast
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from birthsim.command_line.start import perform
from birthsim_env.physics.compiled.sources import ROOT, files_of
from birthsim_env.physics.rig.values import near, shown

STUDIES = Path(__file__).parents[1] / "studies"


class Listed(NamedTuple):
    """A study as its file registers it: the module below ``lab.studies``, what it measures, and whether it is a function, a
    command of its own, instead of a declared ``Study``."""

    module: str
    about: str
    is_command: bool


OWN = {
    "status": "list which results/*.json are fresh, and what has changed",
    "render": "write tables of docs, and scores, from results/",
    "draw": "draw the pictures of docs from results/*.json",
    "renew": "run every study whose result is stale",
}


@cache
def studies() -> dict[str, Listed]:
    """Every study by name, sorted."""
    found = dict[str, Listed]()
    for path in files_of(STUDIES.relative_to(ROOT).as_posix()):
        if b"register(study=" in (content := path.read_bytes()):
            module = ".".join(path.relative_to(STUDIES).with_suffix("").parts)
            found |= dict(_registered(ast.parse(content), module))
    return dict(sorted(found.items()))


def _registered(tree: ast.AST, module: str) -> Iterator[tuple[str, Listed]]:
    """The studies that a file registers, by name."""
    functions = [one for one in ast.walk(tree) if isinstance(one, ast.FunctionDef)]
    decorators = {id(one) for function in functions for one in function.decorator_list}
    for one in ast.walk(tree):
        if isinstance(one, ast.Call) and isinstance(one.func, ast.Name) and one.func.id == "register":
            words = {word.arg: ast.literal_eval(word.value) for word in one.keywords}
            yield words["study"], Listed(module, words["about"], id(one) in decorators)


def overview() -> str:
    """The help: one line a study."""
    width = max(map(len, studies()))
    lines = [f"  {name:{width}}  {study.about}" for name, study in studies().items()]
    own = [f"  {name:{width}}  {does}" for name, does in OWN.items()]
    return "\n".join(["usage: birthsim study NAME ...", "", *lines, "", *own, "", "example: birthsim study speed"])


def main(arguments: list[str]) -> None:
    """Run the study that the first argument names; the others are its own."""
    if not arguments or arguments[0] in ("-h", "--help"):
        print(overview())
        raise SystemExit(0 if arguments else 2)
    name, *rest = arguments
    if name not in {**studies(), **OWN}:
        allowed = ", ".join([*OWN, *studies()])
        print(f"birthsim study: error: NAME = {shown(name)}{near(name, studies())}; allowed: {allowed}", file=sys.stderr)
        raise SystemExit(2)
    sys.argv = ["", *rest]
    is_command = name not in OWN and studies()[name].is_command
    module = f"lab.studies.{studies()[name].module}" if is_command else "lab.engine.shelf"
    perform(f"birthsim study {name}", import_module(module))
