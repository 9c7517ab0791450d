"""The best value of a column is bold, and only there where rows may be compared."""

import re

import pytest

from studies.shelf import texts
from studies.tables import markdown

TOLD = {"admittance-backstepping", "admittance-adaptive", "pid", "lqr", "sliding-mode"}
"""Controllers of the comparison that a force sensor tells of the hand."""

HEAD = ["controller", "error, mm", "bandwidth, Hz", "lost"]


def bold(table: str) -> list[str]:
    return re.findall(r"\*\*(.*?)\*\*", table)


def test_the_smallest_and_the_largest_first_figure() -> None:
    rows = [HEAD, ["a", "1.2, 9", "3 [1, 4]; 2", "0"], ["b", "0.3; 99", "20; 1", "0"], ["c", "lost", "-", "0"]]
    table = markdown(rows, ["error, mm"], ["bandwidth, Hz"])
    assert table.splitlines()[3] == "| b | **0.3**; 99 | **20**; 1 | 0 |"
    assert bold(table) == ["0.3", "20"]
    assert bold(markdown(rows)) == []


def test_among_rows_of_equal_information() -> None:
    rows = [HEAD, *([name, error, "1", "0"] for name, error in (("a", "3"), ("b", "2"), ("c", "1"), ("d", "1e-05")))]
    assert bold(markdown(rows, ["error, mm"], alike=["none", "none", "force", "force"])) == ["2", "1e-05"]
    assert bold(markdown(rows, ["error, mm"], alike=["none", "none", "none", "force"])) == ["1"], "one alone is not the best"


def test_rows_that_are_as_good_share_it_and_all_of_them_have_none() -> None:
    rows = [HEAD, *([name, error, "none", "0"] for name, error in (("a", "1"), ("b", "1"), ("c", "2")))]
    assert bold(markdown(rows, ["error, mm"], ["bandwidth, Hz"])) == ["1", "1"]
    assert bold(markdown(rows[:3], ["error, mm"])) == []
    assert bold(markdown([HEAD, *([name, "lost", "", ""] for name in "ab")], ["error, mm"])) == []


@pytest.mark.parametrize("force", [False, True])
def test_the_comparison_marks_the_least_error_of_those_told_the_same(force: bool) -> None:
    table = {file.name: text for file, text in texts("comparison")}["comparison.md"]
    rows = [line.split(" | ") for line in table.split("\n\n")[1].splitlines()][2:]
    own = [row for row in rows if (row[0][2:] in TOLD) is force]
    errors = [float(row[1].replace("**", "").split(" ")[0]) for row in own]
    assert len(own) > 4
    marked = [row[1].startswith("**") for row in own]
    assert marked == [error == min(errors) for error in errors]
