"""What tables show of results: in bold the best value among rows that may be compared."""

import re

import pytest

from lab.engine.results import read_result
from lab.engine.shelf import texts
from lab.engine.tables import WIDEST, Head, digits, markdown

TOLD = {
    "admittance-backstepping", "admittance-adaptive", "pid", "lqr", "sliding-mode", "adrc", "disturbance-observer",
    "time-delay", "super-twisting", "adaptive-robust", "iterative-learning", "backstepping-integral-compliant",
}  # fmt: skip
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


def test_a_statistic_has_a_column_of_its_own() -> None:
    head = Head("hunting, mm", ("median", "worst"))
    table = markdown(
        [["controller", head, "lost"], ["a", [2.0, 31.25], "0"], ["b", [0.00004, 17.0], "1"], ["c", "-", "2"]], [head]
    )
    assert table.splitlines() == [
        "| controller | hunting, mm: median | hunting, mm: worst | lost |",
        "|---|---|---|---|",
        "| a | 2.00 | 31.2 | 0 |",
        "| b | **<0.001** | 17.0 | 1 |",
        "| c | - | - | 2 |",
    ]
    with pytest.raises(ValueError, match=r"3 entries \[1.0, 2.0, 3.0\]; allowed: 2, one below each statistic"):
        markdown([["controller", head], ["a", [1.0, 2.0, 3.0]]])


def test_a_wide_table_becomes_several_that_all_say_whose_rows_they_are() -> None:
    heads = [Head(f"{name}, mm", ("median", "95 %", "worst")) for name in "abcdefg"]
    wide = markdown([["controller", "rig", *heads, "lost"], ["pid", "told", *([1.0, 2.0, 3.0] for _ in heads), "0"]])
    lines = [table.splitlines() for table in wide.split("\n\n")]
    assert [line[2].startswith("| pid | told |") for line in lines] == [True] * 3
    assert [line[0].count(" | ") + 1 for line in lines] == [11, 11, 6]
    assert max(line[0].count(" | ") + 1 for line in lines) <= WIDEST
    assert lines[2][0].endswith("g, mm: worst | lost |")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (9.999, "10.0"),
        (0.05678, "0.0568"),
        (-123.6, "-124"),
        (1.31e4, "13,100"),
        (8.93e-5, "<0.001"),
        (-8.93e-5, ">-0.001"),
        (float("inf"), "lost"),
        (float("nan"), "-"),
        ("refused", "refused"),
    ],
)
def test_a_number_has_three_digits_and_no_exponent(value: float | str, text: str) -> None:
    assert digits(value) == text


def test_no_table_of_a_comparison_has_two_statistics_in_a_cell() -> None:
    """Intervals stand beside their median; a list, a semicolon or an exponent in a cell is what readers stumbled at."""
    for study in ("comparison", "honest", "haptics", "clamp", "sensorless", "worst", "friction-laws"):
        for file, text in texts(study):
            cells = [cell for line in text.splitlines() if line.startswith("|") for cell in line.strip("| ").split(" | ")]
            crowded = [
                cell for cell in cells if re.fullmatch(r"-?[\d.]+(e[+-]\d+)?([,;/] .*)", cell) or re.search(r"\de[+-]\d", cell)
            ]
            assert file.suffix != ".md" or crowded == [], (file.name, crowded[:3])


@pytest.mark.parametrize("force", [False, True])
def test_the_comparison_marks_the_least_error_of_those_told_the_same(force: bool) -> None:
    table = {file.name: text for file, text in texts("comparison")}["comparison.md"]
    rows = [line.split(" | ") for line in table.split("\n\n")[1].splitlines()][2:]
    own = [row for row in rows if (row[0].strip("| `") in TOLD) is force]
    errors = [float(row[4].replace("**", "").split(" ")[0]) for row in own]
    assert len(own) > 4
    assert {row[3] for row in own} == {"yes" if force else "no"}
    marked = [row[4].startswith("**") for row in own]
    assert marked == [error == min(errors) for error in errors]


def bandwidth(controller: str, sensors: str, push: str, axis: str, column: str = "bandwidth") -> float:
    table = read_result("bandwidth")["figures"]
    (row,) = (row for row in table["rows"] if row[:4] == [controller, sensors, push, axis])
    return float(row[table["columns"].index(column)])


def test_what_pages_say_in_words_of_bandwidths_holds() -> None:
    """Words round: this fails when a renewed result leaves what docs/explanation/hand.md and laboratory/bandwidth.md say."""
    adaptive, accelerated, known = "admittance-adaptive", "honest, acceleration", "honest, acceleration, rig known"
    said = {("ideal", 2.5, 5.5), ("honest", 0.7, 1.5), (accelerated, 3.0, 4.6), (known, 5.5, 8.5)}
    for sensors, least, most in said:
        for axis in "xy":
            assert least < bandwidth(adaptive, sensors, "10 N", axis) < most, (sensors, axis)
    assert bandwidth(adaptive, "honest", "slow lines of 4.9 N", "x") == 0.9
    assert bandwidth(adaptive, "honest", "2 N", "x") < 0.2
    for push, column, least, most in (
        ("slow lines of 4.9 N", "bandwidth", 0.3, 0.5),
        ("slow lines of 4.9 N", "unnoticed", 0.85, 0.95),
        ("one sine of 20 N", "unnoticed", 4.5, 5.5),
        ("one sine of 5 N", "unnoticed", 0.15, 0.25),
    ):
        assert least < bandwidth("admittance-sensorless", known, push, "x", column) < most, (push, column)


def test_a_stiff_hand_makes_most_controllers_tremble_and_the_best_one_little() -> None:
    """README, laboratory/stiff_hand.md, limits.md: more than 10 N, and of the best one less than 5 N, 12 N at 95 %."""
    held = [one for one in read_result("clamp")["figures"] if (one["stiffness"], one["damping"]) == (2e4, 60.0)]
    drawn = [one for one in held if one["friction"] == "lugre-drawn" and one["rig"] == "default"]
    best = [one["force"] for one in drawn if one["controller"] == "admittance-adaptive"]
    others = [one["force"] for one in drawn if "admittance-adaptive" not in one["controller"]]
    assert all(median < 5.0 and most < 12.0 for median, most, _ in best)
    assert others
    assert all(median > 10.0 for median, _, _ in others)
