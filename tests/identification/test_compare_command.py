"""birthsim compare and birthsim.compare as a user calls them: tables, a report, its data and figures."""

import re
from pathlib import Path

import pytest

import birthsim
from baselines.identification.log.log_file import write_trial
from birthsim.identification import named_rigs
from birthsim_env.physics.rig.parameters import Parameters
from tests.console import assert_picture, call, strict
from tests.figures import caught
from tests.identification.test_compared import HEAVY
from tests.identification.trials import TRUE, part, trial


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """2.1 s of a log, and beside it the files of its rig and of a heavier one."""
    write_trial(part(trial(), 0, 2100), tmp_path / "log.csv", TRUE)
    TRUE.to_toml(tmp_path / "true.toml")
    HEAVY.to_toml(tmp_path / "heavy.toml")
    return tmp_path / "log.csv"


def test_several_rigs_are_ranked_and_reported(
    log: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, out = log.parent, log.parent / "out"
    drawn = caught(monkeypatch, written=True)
    rigs = [folder / "heavy.toml", folder / "true.toml"]
    status, printed, _ = call("compare", monkeypatch, capsys, log, "--parameters", *rigs, "--out", out)
    assert (status, [faults for _, faults in drawn]) == (0, [[], []])
    ranking = [line.split()[0] for line in printed.splitlines() if re.match(r"\S+\.toml +\d", line)]
    assert ranking == ["true.toml", "heavy.toml"]
    assert "true.toml is nearer to the log than heavy.toml" in printed
    names = ["compare.json", "free_run.png", "free_run.svg", "report.md", "twin.rec", "windows.png", "windows.svg"]
    assert sorted(path.name for path in out.iterdir()) == names
    assert_picture(out, "free_run")
    assert_picture(out, "windows")
    data = strict(out / "compare.json")
    assert [place["name"] for place in data["ranking"]] == ["true.toml", "heavy.toml"]
    assert data["ranking"][1]["is_worse"]
    text = (out / "report.md").read_text()
    for part_of in (
        "# log.csv",
        "## heavy.toml",
        "## true.toml",
        "in free run",
        "the worst windows of",
        "![windows.png](windows.png)",
    ):
        assert part_of in text


def test_for_a_paper_its_figures_are_linked_pdfs(
    log: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = log.parent / "out"
    status, printed, _ = call("compare", monkeypatch, capsys, log, "--style", "paper", "--out", out)
    assert status == 0
    pictures = {path.name for path in out.iterdir() if path.suffix in (".png", ".svg", ".pdf")}
    assert pictures == {"free_run.pdf", "windows.pdf"}
    assert all(name in printed for name in pictures)
    text = (out / "report.md").read_text()
    assert "[windows.pdf](windows.pdf)" in text
    assert "![" not in text


def test_one_rig_is_shown_in_full_with_the_limits_that_are_asked(
    log: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    line = [log, "--parameters", log.parent / "heavy.toml", "--position-limit", 0.004, "--multiple", 20]
    status, printed, _ = call("compare", monkeypatch, capsys, *line)
    assert status == 0
    assert re.search(r"position_y +4 mm +\d\.\d+ s, after", printed)
    assert re.search(r"pressures_P1 +10\d00 Pa", printed)  # 20 times 0.5 kPa
    for words in ("each begun anew", "in free run from 0.1 to 2.099 s", "how far ahead", "what the rig does"):
        assert words in printed
    assert not [path for path in log.parent.iterdir() if path.is_dir()]


def test_rigs_are_called_by_their_files_as_far_as_that_tells_them_apart(tmp_path: Path) -> None:
    for place in ("one", "two"):
        (tmp_path / place).mkdir()
        TRUE.to_toml(tmp_path / place / "rig.toml")
    one, two = tmp_path / "one" / "rig.toml", tmp_path / "two" / "rig.toml"
    assert list(named_rigs([one])) == ["rig.toml"]
    assert list(named_rigs([one, two])) == [str(one), str(two)]
    assert list(named_rigs([None, HEAVY, {"mechanics.mass": 4.0}])) == ["the default rig", "rig 2", "rig 3"]
    assert named_rigs([None])["the default rig"] == Parameters()
    with pytest.raises(ValueError, match=r"parameters = .* is given twice; allowed: "):
        named_rigs([one, one])
    with pytest.raises(ValueError, match=r"parameters = \[\]; allowed: "):
        birthsim.compare("log.csv", [])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("window", 0.01),
        ("window", "long"),
        ("multiple", 0),
        ("pressure_limit", float("nan")),
        ("position_limit", -1.0),
        ("horizon", 1e3),
    ],
)
def test_arguments_that_mean_nothing_are_refused(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=f"{name} = .*; allowed: a finite number"):
        birthsim.compare("log.csv", TRUE, **{name: value})  # type: ignore[arg-type]
