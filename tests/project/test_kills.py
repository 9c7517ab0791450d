"""The harness itself: it ends what it begins, and sees what is torn."""

import shutil

import numpy as np
import pytest

from birthsim_env.physics.compiled.sources import ROOT
from lab.engine.results import commit
from lab.studies.kills import checks
from lab.studies.kills.report import read_outcomes, write_outcomes, write_page
from lab.studies.kills.targets import TARGETS, Target
from lab.studies.kills.tries import Course, Outcome

DOCS = ROOT / "docs"


@pytest.mark.slow
def test_a_killed_export_goes_on(tmp_path):
    """One kill and one termination; a full disk would need root."""
    course = Course(TARGETS["export"], tmp_path, np.random.default_rng(0))
    for scenario in ("SIGKILL", "SIGTERM", "two at once"):
        outcome = course.attempt(scenario)
        assert outcome.equal, outcome
        faults = outcome.broken, outcome.leftovers, outcome.tracebacks, outcome.talk, outcome.alive, outcome.trouble
        assert not any(faults), outcome


def test_files_that_are_torn_are_seen_and_hidden_ones_are_leftovers(tmp_path):
    files = {"whole.json": "{}", "trials.journal": '{"a": 1}\n{"a"', ".birthsim/0-1/whole.json": "{"}
    torn = {"torn.json": '{"a": 1', "torn.md": "| a |", "torn.png": "PNG", "torn.svg": "<svg><g>"}
    for name, text in (files | torn).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert [line.partition(":")[0] for line in checks.broken(tmp_path)] == list(torn)
    assert checks.leftovers(tmp_path) == [".birthsim/0-1/whole.json"]


def test_results_are_equal_but_for_what_may_differ(tmp_path):
    target = Target("one", "birthsim-one", (), differ=("times.json",), costs=("cost",))
    one, other = tmp_path / "one", tmp_path / "other"
    (one / "pieces").mkdir(parents=True)
    (one / "pieces" / "a.json").write_text('{"result": [{"cost": 1, "error": 2}]}')
    (one / "all.json").write_text('{"cost": 1}')
    (one / "times.json").write_text("{}")
    shutil.copytree(one, other)
    (other / "times.json").write_text("[]")
    (other / "pieces" / "a.json").write_text('{"result": [{"cost": 3, "error": 2}]}')
    assert checks.results(target, one) == checks.results(target, other)
    (other / "all.json").write_text('{"cost": 3}')
    found, others = checks.results(target, one), checks.results(target, other)
    assert [name for name in found if found[name] != others[name]] == ["all.json"]


def test_progress_bars_are_no_complaints():
    said = "BirthSIM: compiling kernels\nepisodes:  50%|##   | 1/2 [00:18<00:18, 18.28s/piece]\rbirthsim-x: terminated\n"
    assert checks.said(said) == ["birthsim-x: terminated"]


def test_the_page_is_that_of_its_outcomes(tmp_path):
    write_page(tmp_path / "kills.md", read_outcomes(DOCS / "kills.json"))
    assert (tmp_path / "kills.md").read_text() == (DOCS / "kills.md").read_text()


def test_the_page_counts_and_names_what_fell_short(tmp_path):
    outcomes = [
        Outcome("tune", "SIGKILL", "1 s", 1, [-9, 0], equal=True),
        Outcome("tune", "SIGKILL", "2 s", 3, [-9, -9, -9, 0], leftovers=["a.partial"], trouble=["differs: a"]),
    ]
    write_outcomes(tmp_path / "kills.json", outcomes[:1], 0)
    write_page(tmp_path / "kills.md", write_outcomes(tmp_path / "kills.json", outcomes, 0))
    page = (tmp_path / "kills.md").read_text()
    assert "| tune | SIGKILL | 4 | 2 | 1 | 0 | 0 | 1 | 0 | 0 | 0 | 1 |" in page
    assert "- tune, SIGKILL, 2 s: left: a.partial" in page
    assert "- tune, SIGKILL, 2 s: differs: a" in page
    assert f"Tried at commit {commit()[:7]}, " in page
