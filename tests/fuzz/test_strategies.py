"""What is drawn depends on a test and its strategies alone: not on earlier examples, nor on what else is imported."""

import re
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from birthsim_env.physics.rig.values import shown
from tests.fuzz import strategies
from tests.fuzz.strategies import altered, composite, damaged, json_texts, odd_arrays, odd_entries, strange, toml_texts

HUGE = {f"k{k}": "x" * 1000 for k in range(60)}


def drawn(strategy, examples, use=lambda value: None):
    """Words of what a derandomized test draws; ``use`` is what it does to each."""
    words = []

    @settings(max_examples=examples)
    @given(value=strategy)
    def test(value):
        words.append(re.sub("0x[0-9a-f]+", "", shown(value)))
        use(value)

    test()
    return words


def spoil(value):
    """Changes all that can be changed in a value."""
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, (list, tuple)) else ()
    for one in list(inside):
        spoil(one) if one is not value else None
    if isinstance(value, list):
        value.append("spoilt")
    elif isinstance(value, dict):
        value["spoilt"] = 1
    elif isinstance(value, set):
        value.add("spoilt")
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f":
        value.fill(7.0)


def test_what_a_test_does_to_a_value_no_other_example_sees():
    values = strategies.sampled(([], [[1.0]], {"a": []}, {1}, np.zeros(3), ([2],)))
    first = drawn(values, 60, spoil)
    assert len(set(first)) == 6
    assert not any("spoilt" in words or "7." in words for words in first)
    assert drawn(values, 60) == first
    assert drawn(altered({"a": {"b": [1.0]}}), 200, spoil) == drawn(altered({"a": {"b": [1.0]}}), 200)


def test_what_is_imported_changes_no_draw(tmp_path):
    """As long as Hypothesis draws literals of the packages, a commit anywhere makes other examples of all tests."""
    before = drawn(st.integers(), 200), drawn(st.floats(), 200), drawn(st.text(), 200)
    path = tmp_path / "literals.py"
    path.write_text("\n".join(f"X{k} = ({k}0001, {k}.{k}001, 'literal {k}')" for k in range(100, 300)), encoding="utf-8")
    spec = spec_from_file_location("literals", path)
    sys.modules["literals"] = module_from_spec(spec)
    try:
        assert (drawn(st.integers(), 200), drawn(st.floats(), 200), drawn(st.text(), 200)) == before
    finally:
        del sys.modules["literals"]


@pytest.mark.parametrize("make", [altered, json_texts, odd_arrays, odd_entries])
def test_a_strategy_of_much_is_short_when_written(make):
    """Hypothesis writes strategies beside an error; its warning of a long one would stand in place of the error."""
    assert len(repr(make(HUGE))) < 2000
    assert len(repr(toml_texts([HUGE]))) < 300
    assert len(repr(damaged(bytes(60_000)))) < 300


def test_a_draw_may_compute_what_is_not_finite():
    @composite
    def overflows(draw, array):
        return array.astype("f2") + draw(st.integers(0, 1))

    assert "inf" in drawn(overflows(np.full(3, 1e30)), 1)[0]


def test_values_are_drawn_by_these_alone():
    """Hypothesis' own hand one object to several examples, or write their arguments."""
    for path in Path(__file__).parent.glob("*.py"):
        if path.stem != "strategies" and path != Path(__file__):
            assert not re.search(r"\bst\.(composite|just|sampled_from)\b", path.read_text(encoding="utf-8")), path.name
    for value in drawn(strange, 100):
        assert "<unprintable" not in value
