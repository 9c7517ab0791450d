"""Figures in prose come from results: every name that docs and README quote leads to one figure."""

import re

import pytest

from birthsim_env.physics.compiled.sources import ROOT
from studies.figures import figure
from studies.results import read_result

QUOTED = sorted({
    (path.relative_to(ROOT).as_posix(), name)
    for path in [ROOT / "README.md", ROOT / "paper.md", *(ROOT / "docs").rglob("*.md")]
    for pair in re.findall(r"\{figure\}`([^`]+)`|<!-- figure ([^>]+) -->", path.read_text(encoding="utf-8"))
    for name in pair if name
})  # fmt: skip


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
