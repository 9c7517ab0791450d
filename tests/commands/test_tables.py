"""Tables that commands print: decimal points below each other, in 80 columns."""

import pytest

from agents.policy.seeds import policy_folders
from agents.reports import inspection
from baselines.tables import aligned, markdown
from birthsim.commands import explain


def test_decimal_points_stand_below_each_other_and_words_to_the_left():
    rows = [("slow", "1,234.5", "12", "lost"), ("quicker", "-0.00025", "3 (4.5)", "1.5")]
    assert aligned(("", "mm", "count", "rest"), rows).splitlines() == [
        "                  mm     count  rest",
        "slow     1,234.5      12        lost",
        "quicker     -0.00025   3 (4.5)  1.5",
    ]
    assert markdown(("a", "b"), [("x", "1")]) == "| a | b |\n| --- | --- |\n| x | 1 |"


@pytest.mark.slow
def test_what_a_policy_has_learned_is_told_in_80_columns(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(inspection, "RIGS", 1)
    monkeypatch.setattr(inspection, "FORCES", inspection.FORCES[:1])
    explain.main(explain.Settings(policy=str(policy_folders("circle")[0]), out=tmp_path))
    printed = capsys.readouterr().out.splitlines()
    tables = [line for line in printed if "  " in line]
    assert len([line for line in tables if line.startswith("seed_0 ")]) == 1 + len(inspection.SETPOINTS)
    assert [line for line in tables if len(line) > 80] == []
    assert (tmp_path / "residual.md").read_text().count("| seed_0 |") == 1 + len(inspection.SETPOINTS)
