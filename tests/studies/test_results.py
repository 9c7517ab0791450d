"""A result says which sources changed since it was measured, and every table is that of its result."""

import pytest

from baselines.work.calls import names_of
from birthsim_env.physics.compiled.sources import ROOT, source
from lab.engine import results, shelf
from lab.engine.results import beginning, changed, provenance, read_result, written
from lab.studies.stability import stiffest
from tests.console import call


def test_a_result_says_what_made_it_and_is_stale_by_the_definition_that_differs(tmp_path):
    measuring = stiffest.STUDY.measuring
    assert read_result("one", tmp_path) is None
    found = {"seconds": 1.0, "settings": {}, "figures": [["a", 2.0], ["b", None]]}
    (tmp_path / "one.json").write_text(written(provenance(beginning(), measuring, {}) | found))
    result = read_result("one", tmp_path)
    assert result["figures"] == [["a", 2.0], ["b", None]]
    assert len(result["commit"]) == 40
    assert set(result["versions"]) == {"python", "numpy", "numba", "scipy", "gymnasium"}
    assert changed(result, measuring) == []
    assert not {path for path in result["sources"] if path.startswith(("tests/", "agents/")) or path == "lab/engine/door.py"}
    result["sources"]["birthsim_env/physics/dynamics.py"]["advance"] = "0"
    del result["sources"]["birthsim_env/physics/seals/friction.py"]["coulomb_force"]
    assert changed(result, measuring) == [
        "birthsim_env/physics/dynamics.py:advance",
        "birthsim_env/physics/seals/friction.py:coulomb_force",
    ]


def test_a_result_with_hashes_of_files_names_those_that_changed():
    path = "birthsim_env/physics/seals/friction.py"
    content = {"sources": {path: source(ROOT / path).code, "birthsim_env/gone.py": "0", "birthsim_env/reward.py": "0"}}
    assert changed(content, stiffest.STUDY.measuring) == ["birthsim_env/gone.py", "birthsim_env/reward.py"]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"a":' * 9000, '{"date": "x"}', "\xff"])
def test_a_damaged_result_is_named(text, tmp_path, monkeypatch):
    monkeypatch.setattr(results, "RESULTS", tmp_path)
    (tmp_path / "circle.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(ValueError, match=r"^result = .*circle\.json' is damaged.*; allowed: "):
        shelf.state("circle")


def test_settings_that_a_study_no_longer_has_are_told(monkeypatch):
    content = read_result("circle")
    content["settings"]["gone"] = 3
    monkeypatch.setattr(shelf, "read_result", lambda name: content)
    assert "'gone' = 3, not an option" in shelf.state("circle")


def test_what_is_no_number_is_no_result():
    with pytest.raises(ValueError, match="JSON"):
        written({"figures": [float("nan")]})


@pytest.mark.parametrize("name", shelf.names())
def test_every_declared_study_has_a_state_and_measures_by_functions_with_names(name):
    """A nameless one would be followed by its whole file, tables and pictures too."""
    named = set().union(*map(names_of, shelf.declared(name).measuring))
    assert [one for one in named if "<" in one] == []
    assert shelf.state(name).partition(";")[0] in ("fresh", "stale", "not measured yet")


def test_every_stored_result_belongs_to_a_study():
    stored = {path.stem for path in (ROOT / "lab" / "results").glob("*.json")}
    assert stored <= set(shelf.names())


def test_rendering_changes_nothing():
    """What the tables say is what the results say: ``birthsim study render``."""
    for path, text in shelf.rendered().items():
        assert path.read_text(encoding="utf-8") == text, path


def test_a_table_that_is_typed_is_written_anew(tmp_path, monkeypatch):
    name = next(name for name in shelf.names() if read_result(name))
    monkeypatch.setattr(shelf, "DATA", tmp_path)
    expected = {path.name: text for path, text in shelf.texts(name)}
    (tmp_path / next(iter(expected))).write_text("| typed |")
    monkeypatch.setattr(shelf, "names", lambda: [name])
    monkeypatch.setattr(shelf, "ROOT", tmp_path)
    shelf.render()
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == expected


def test_status_lists_every_study(monkeypatch, capsys):
    status, printed, _ = call("study", monkeypatch, capsys, "status")
    assert (status, [line.split()[0] for line in printed.splitlines()]) == (0, shelf.names())
