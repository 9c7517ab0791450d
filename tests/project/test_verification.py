"""docs/laboratory/verification.md and promises.md: what they name exists, with its bounds, and no equation is missing."""

import ast
import re
from functools import cache

import pytest

from tests.console import ROOT

LABORATORY = ROOT / "docs" / "laboratory"
PAGE = "".join((LABORATORY / f"{name}.md").read_text(encoding="utf-8") for name in ("verification", "promises"))
TESTS = sorted(set(re.findall(r"`([\w/]+\.py)::(\w+)`", PAGE)))
CODE = [(path, re.findall(r"\w+", names)) for path, names in re.findall(r"`(\w+/[\w/]+\.py)`: (`\w+`(?:, `\w+`)*)", PAGE)]
BOUNDS = [(bounds, tests) for bounds, tests in re.findall(r"\| ([^|]*: [\d.]+(?:e-?\d+)?) \| (`[^|]+`) \|", PAGE)]
EQUATIONS = {*range(1, 20)} - {7, 15}
"""Of the paper; (7) and (15) have no code of their own."""


@cache
def defined(path):
    """Names that a file defines at its top or in a class."""
    names, waiting = set(), list(ast.parse((ROOT / path).read_text(encoding="utf-8")).body)
    for node in waiting:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
            waiting += node.body if isinstance(node, ast.ClassDef) else []
    return names


@pytest.mark.parametrize(("path", "name"), TESTS)
def test_every_test_named_exists(path, name):
    assert name in defined(f"tests/{path}")
    assert name.startswith("test_")


@pytest.mark.parametrize(("path", "names"), CODE)
def test_every_equation_stands_where_it_is_said_to_stand(path, names):
    assert set(names) <= defined(path)


def numbers(text):
    """Equations of the paper that a text names: (3), (11)-(14)."""
    found = re.findall(r"\((\d{1,2})\)(?:-\((\d{1,2})\))?", text)
    return {number for first, last in found for number in range(int(first), int(last or first) + 1)}


def test_no_equation_and_no_table_is_missing():
    assert len(TESTS) > 60
    assert len(CODE) > 30
    assert len(BOUNDS) > 3
    assert numbers(PAGE) >= EQUATIONS


@pytest.mark.parametrize("bounds", BOUNDS, ids=lambda row: row[0][:40])
def test_a_bound_stands_in_its_tests(bounds):
    said, tests = bounds
    paths = re.findall(r"`([\w/]+\.py)::", tests)
    texts = "".join((ROOT / "tests" / path).read_text(encoding="utf-8") for path in paths)
    for bound in re.findall(r": ([\d.]+(?:e-?\d+)?)(?:;|$)", said):
        assert re.search(rf"(?<![\d.]){re.escape(bound)}(?![\d.])", texts), bound
