"""A result says which sources changed since it was measured."""

from __future__ import annotations

import json

import pytest

from baselines.work.sources import ROOT, hashes
from studies.door import STUDIES, state
from studies.results import changed, measure
from tests.console import call

MODULE = "studies.stability.stiffest"


def test_sources_follow_imports_and_names_in_strings():
    found = hashes(MODULE)
    assert {"studies/stability/stiffest.py", "baselines/registry.py", "baselines/backstepping/stiffest.py"} <= found.keys()
    assert "studies/door.py" not in found
    assert not any(path.startswith("tests/") for path in found)


def test_a_result_says_what_made_it_and_is_stale_by_the_file_that_differs(tmp_path):
    assert changed("one", MODULE, tmp_path) is None
    path = measure("one", MODULE, {"mass": "kg"}, (3,), lambda: [{"mass": 2.0}], tmp_path)
    result = json.loads(path.read_text())
    assert (result["rows"], result["units"], result["seeds"]) == ([{"mass": 2.0}], {"mass": "kg"}, [3])
    assert len(result["commit"]) == 40
    assert set(result["versions"]) == {"python", "numpy", "numba", "scipy", "gymnasium"}
    assert changed("one", MODULE, tmp_path) == []
    sources = result["sources"] | {"baselines/registry.py": "0", "gone.py": "0"}
    path.write_text(json.dumps(result | {"sources": sources}))
    assert changed("one", MODULE, tmp_path) == ["baselines/registry.py", "gone.py"]


def test_what_is_no_number_is_no_result(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        measure("one", MODULE, {"mass": "kg"}, (), lambda: [{"mass": float("nan")}], tmp_path)
    assert not list(tmp_path.glob("*.json"))


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_is_a_file_and_has_a_state(name):
    assert f"studies/{STUDIES[name].module.replace('.', '/')}.py" in hashes(f"studies.{STUDIES[name].module}")
    assert state(name).partition(";")[0] in ("fresh", "stale", "no result in results/")


def test_every_stored_result_belongs_to_a_study():
    stored = {path.stem for path in (ROOT / "results").glob("*.json")}
    assert stored <= set(STUDIES)


def test_status_lists_every_study(monkeypatch, capsys):
    status, printed, _ = call("study", monkeypatch, capsys, "status")
    assert (status, [line.split()[0] for line in printed.splitlines()]) == (0, list(STUDIES))
