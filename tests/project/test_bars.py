"""Progress bars: a count and its unit are two words."""

import ast

from birthsim_env.physics.compiled.sources import files_of

PACKAGES = (
    "birthsim",
    "birthsim_env",
    "birthsim_build",
    "birthsim_drive",
    "birthsim_live",
    "baselines",
    "agents",
    "lab",
    "examples",
)


def bars():
    """(file, expression of the unit or None) of every bar."""
    for path in files_of(*PACKAGES):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "tqdm":
                yield path.name, next((word.value for word in node.keywords if word.arg == "unit"), None)


def test_a_unit_stands_off_its_count():
    found = list(bars())
    assert len(found) > 10
    for name, unit in found:
        first = unit.values[0] if isinstance(unit, ast.JoinedStr) else unit
        assert isinstance(first, ast.Constant), f"{name}: a bar without a unit counts in it/s"
        assert first.value.startswith(" "), f"{name}: {first.value!r} would be stuck to its count"
