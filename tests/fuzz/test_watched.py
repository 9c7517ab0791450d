"""The checker itself sees every misbehaviour, and its own damage damages."""

import os
import sys
from importlib import import_module
from itertools import repeat

import numpy as np
import pytest
from hypothesis import find

from birthsim_env.gradients import tracing
from birthsim_env.physics.rig.values import LONGEST, shown
from tests.fuzz import watched as watching
from tests.fuzz.strategies import altered, damaged, nested
from tests.fuzz.watched import TooSlow, watched


def doubled(value):
    return 2 * value


def raises(error):
    raise error


ELSEWHERE = f"fuzz-elsewhere-{os.getpid()}"
CLEAR = ValueError("argument = 3; allowed: less")
MISBEHAVIOUR = {
    "names": (lambda folder: raises(ValueError("3; allowed: less")), AssertionError),
    "allowed": (lambda folder: raises(ValueError("argument = 3 is wrong")), AssertionError),
    "lines": (lambda folder: raises(ValueError("argument = 3;\nallowed: less")), AssertionError),
    "kind of a ValueError": (lambda folder: raises(UnicodeError("argument = 3; allowed: less")), AssertionError),
    "other error": (lambda folder: raises(KeyError("argument = 3; allowed: less")), KeyError),
    "memory": (lambda folder: np.ones(2**27), MemoryError),
    "time": (lambda folder: sum(1 for _ in repeat(0)), TooSlow),
    "process": (lambda folder: os.system("true"), AssertionError),
    "writing": (lambda folder: (folder.parent / ELSEWHERE).write_text("x"), AssertionError),
    "foreign code": (lambda folder: exec(compile("1", "/tmp/foreign.py", "exec")), AssertionError),
}


@pytest.mark.parametrize("deed", MISBEHAVIOUR)
def test_every_misbehaviour_is_seen(deed, monkeypatch):
    monkeypatch.setattr(watching, "SECONDS", 0.3)
    misbehave, error = MISBEHAVIOUR[deed]
    with pytest.raises(error), watched("argument") as example:
        misbehave(example.folder)
    (example.folder.parent / ELSEWHERE).unlink(missing_ok=True)


def test_what_works_and_what_is_refused_clearly_pass():
    with watched("argument") as example:
        (example.folder / "own").write_text("x")
    assert example.refused == ""
    with watched("argument") as example:
        raise CLEAR
    assert example.refused == str(CLEAR)


def test_a_module_may_be_imported_for_the_first_time(tmp_path, monkeypatch):
    """In a new clone no module is compiled; which of a lot of examples imports it first, chance decides."""
    (tmp_path / "late_module.py").write_text("X = 1\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    with watched("argument", runs_code=True):
        assert import_module("late_module").X == 1
    assert list((tmp_path / "__pycache__").glob("late_module*"))


def test_the_package_may_make_code_once_in_a_process(monkeypatch):
    """Functions are rewritten for gradients when a controller is first made, in whichever example that is."""
    monkeypatch.setattr(tracing, "_REWRITTEN", {})
    with watched("argument"):
        assert tracing.rewritten(doubled)(2) == 4


def test_any_value_is_shown_in_a_short_line():
    silent = type("Odd", (), {"__repr__": None})()
    for value in (10**320, 16**5000, -(10**320), nested(3000), "x" * 5000, "a\nb", np.zeros((9, 9)), silent):
        text = shown(value)
        assert 0 < len(text) <= LONGEST
        assert "\n" not in text


TREE = {"a": {"b": [1.0, 2.0]}}
OTHERS = {
    "removed": lambda tree: tree == {"a": {}},
    "renamed": lambda tree: "as" in tree,
    "halved": lambda tree: tree == {"a": {"b": [1.0]}},
}


@pytest.mark.parametrize("other", OTHERS)
def test_any_place_of_a_tree_is_altered(other):
    assert find(altered(TREE), OTHERS[other])
    assert TREE == {"a": {"b": [1.0, 2.0]}}


@pytest.mark.parametrize("content", [b"", b"ab", b"abcabc"])
def test_bytes_are_cut_dropped_and_repeated(content):
    assert find(damaged(b"abc"), lambda data: data == content) == content
