"""What pages show of results: figures in prose, each of one row, and in bold the best value among rows that may be compared."""

import re

import pytest

from birthsim_env.physics.compiled.sources import ROOT
from lab.studies.figures import figure
from lab.studies.results import read_result
from lab.studies.shelf import texts
from lab.studies.tables import markdown

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


QUOTED = sorted(
    {
        (path.relative_to(ROOT).as_posix(), name)
        for path in [ROOT / "README.md", ROOT / "lab" / "paper" / "paper.md", *(ROOT / "docs").rglob("*.md")]
        for pair in re.findall(r"\{figure\}`([^`]+)`|<!-- figure ([^>]+) -->", path.read_text(encoding="utf-8"))
        for name in pair
        if name
    }
)


@pytest.mark.parametrize(("page", "name"), QUOTED)
def test_what_prose_quotes_is_a_figure(page, name):
    assert re.fullmatch(r"-?[\d.,e+-]+|lost", figure(name)), page


def test_a_figure_is_that_of_its_row():
    figures = read_result("circle")["figures"]
    row = next(row for row in figures["rows"] if row[4] == "pid" and row[1] == "lab")
    where = dict(zip(figures["columns"], row, strict=True))
    assert where["metric"] == "settled_rms"
    assert figure("circle:lab/pid/settled_rms/median") == f"{where['median']:.3g}"
    assert figure("worst:0/above") == str(read_result("worst")["figures"][0]["above"])


NONE = {
    "moon:a": "results/moon.json", "circle:lab/settled_rms/median": "rows with ['lab', 'settled_rms']; allowed: one row",
    "circle:lab/pid/settled_rms/size": "of environment, sensors", "worst:0": "is no number",
    "worst:0/nothing": "'nothing'; allowed: controller, sensors",
}  # fmt: skip


@pytest.mark.parametrize(("name", "said"), NONE.items())
def test_a_name_that_leads_to_no_figure_is_refused(name, said):
    with pytest.raises(ValueError, match="figure = ") as refusal:
        figure(name)
    assert said in str(refusal.value)
