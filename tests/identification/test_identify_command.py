"""birthsim identify as a user runs it: an experiment, its log, the rig; Ctrl-C."""

import re
from pathlib import Path

import numpy as np
import pytest

from baselines.identification.fit import budget
from baselines.identification.identified import identify as identify_trial
from baselines.identification.log.log_file import write_trial
from baselines.identification.log.trial import Trial
from baselines.identification.windows.windows import REMEMBER
from birthsim.commands import identify
from birthsim_env.physics.rig.parameters import DECLARED, Parameters
from tests.console import call
from tests.figures import caught
from tests.identification.broken import changed, put
from tests.identification.trials import OWNER, TRUE, part, trial


def test_experiment_and_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    plan, log, rig = tmp_path / "plan.csv", tmp_path / "log.csv", tmp_path / "true.toml"
    TRUE.to_toml(rig)
    status, printed, _ = call("identify", monkeypatch, capsys, "--propose", plan, "--duration", 4, "--seed", 3)
    assert (status, printed) == (0, f"written to {plan}: 401 rows of time, target and openings to add to a controller's\n")
    believed: list[Parameters] = []
    made = identify.make_controller
    monkeypatch.setattr(identify, "make_controller", lambda name, rig: believed.append(rig) or made(name, rig))
    status, printed, _ = call("identify", monkeypatch, capsys, "--simulate", plan, "--parameters", rig, "--out", log)
    assert (believed[0].mechanics.mass, believed[0].friction) == (Parameters().mechanics.mass, Parameters().friction)
    assert (believed[0].geometry, believed[0].electronics.control_period) == (TRUE.geometry, TRUE.electronics.control_period)
    assert (status, printed) == (0, f"written to {log}: 4000 rows, 3.999 s\n")
    assert log.read_text().startswith("time,openings_P1,openings_N1,")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log.csv", "plan.csv", "true.toml"]


@pytest.mark.filterwarnings("default")
def test_a_log_that_is_read_by_options_and_what_is_said_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from baselines.identification.log.log_file import write_trial

    def read(found: Trial, *_: object, **__: object) -> None:
        trials.append(found)
        raise ValueError("read")

    trials: list[Trial] = []
    short, log = part(trial(), 0, 2100), tmp_path / "log.CSV"
    write_trial(short, log, TRUE)
    head, _, numbers = log.read_text().partition("\n")
    head = head.replace("force_x", "Fz").replace("force_y", "Fq").replace(",", ";")
    log.write_text("Laboratory\n" + head + "\n" + numbers.replace(",", ";").replace(".", ","), encoding="utf-16")
    monkeypatch.setattr(identify, "identify", read)
    line = [log, "--parameters", tmp_path / "true.toml", "--out", tmp_path / "rig.toml", "--decimal-comma", "--skip", 1]
    TRUE.to_toml(tmp_path / "true.toml")
    status, _, complained = call("identify", monkeypatch, capsys, *line)
    assert status == 2
    assert "Fz may be a force; allowed: --columns force_x=" in complained
    status, _, complained = call("identify", monkeypatch, capsys, *line, "--columns", "force_x=Fz,force_y=none")
    first, *_, last = complained.splitlines()
    assert first == f"birthsim identify: warning: log = '{log}': columns that are not used: Fq"
    assert (status, last) == (2, "birthsim identify: error: read")
    for name in ("times", "openings", "pressures", "positions"):
        np.testing.assert_allclose(getattr(trials[0], name), getattr(short, name), rtol=1e-9, atol=1e-12)


@pytest.mark.slow
def test_for_a_paper_the_figures_of_a_log_are_linked_pdfs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    log, report = tmp_path / "log.parquet", tmp_path / "report"
    write_trial(part(trial(), 0, 2100), log, TRUE)
    line = (log, "--out", tmp_path / "rig.toml", "--report", report, "--friction-law", "lugre", "--style", "paper")
    assert call("identify", monkeypatch, capsys, *line)[0] == 0
    assert sorted(path.name for path in report.iterdir()) == ["intervals.pdf", "report.md", "residuals.pdf"]
    text = (report / "report.md").read_text()
    assert "[residuals.pdf](residuals.pdf)" in text
    assert "![" not in text


@pytest.mark.slow
def test_a_rig_from_a_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    log, out, report = tmp_path / "log.parquet", tmp_path / "rig.toml", tmp_path / "report"
    write_trial(trial(), log, TRUE)
    drawn = caught(monkeypatch, written=True)
    status, printed, _ = call("identify", monkeypatch, capsys, log, "--out", out, "--report", report)
    assert (status, [wrong for _, wrong in drawn]) == (0, [[], []])
    found = Parameters.from_toml(out)
    assert found.mechanics.mass == pytest.approx(3.6, rel=5e-3)
    assert found.electronics.pressure_noise == pytest.approx(500, rel=0.05)
    assert f"# mechanics.mass = {found.mechanics.mass:.5g} kg, 95 % interval " in out.read_text()
    assert out.read_text().startswith("# Identified by birthsim identify from log.parquet.\n")
    names = ["intervals.png", "intervals.svg", "report.md", "residuals.png", "residuals.svg"]
    assert sorted(path.name for path in report.iterdir()) == names
    text = (report / "report.md").read_text()
    assert "- mechanics.mass = " in text
    assert "![residuals.png](residuals.png)" in text
    assert f"written to {out}: " in printed
    # What is not identified is the owner's.
    assert found.geometry == OWNER.geometry
    assert found.air == OWNER.air


@pytest.mark.parametrize("name", REMEMBER)
def test_a_rig_with_states_that_no_log_holds_is_refused(name: str) -> None:
    rig = OWNER.replace({name: DECLARED[name].range[1]})
    with pytest.raises(ValueError, match=f"{name} = .*; allowed for an identification: 0, "):
        identify_trial(part(trial(), 0, 2100), rig)


def test_bad_rows_are_named_and_a_fit_without_end_is_no_word_of_a_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(budget, "TIMES", 2.0)
    monkeypatch.setattr(budget, "AT_LEAST", 2.0)
    log, out = tmp_path / "log.csv", tmp_path / "rig.toml"
    write_trial(changed(put("positions", 2000, (12.0, -7.0))), log, OWNER)
    status, printed, wrong = call("identify", monkeypatch, capsys, log, "--out", out)
    assert (status, out.exists()) == (2, False)
    assert printed.startswith(
        "left out: position is outside of the workspace in 1 row (row 2000 at 2 s: (12, -7) m); allowed: "
    )
    assert re.search("disagree so much .*; allowed: columns in their places and units", wrong)
    assert not re.search("SciPy|LAPACK|matrix|Traceback", wrong, re.IGNORECASE)


def test_a_plan_is_written_as_what_it_is_read_as(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _, complained = call("identify", monkeypatch, capsys, "--propose", tmp_path / "plan.parquet")
    assert status == 2
    assert "plan.parquet'; allowed: a file that ends in .csv" in complained
    assert not list(tmp_path.iterdir())
