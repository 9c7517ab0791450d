"""A result says which sources changed since it was measured, and every table is that of its result."""

import pytest

from birthsim_env.physics.compiled.sources import ROOT, hashes
from lab.studies import results, shelf
from lab.studies.results import changed, provenance, read_result, written
from tests.console import call

MODULE = "lab.studies.stability.stiffest"


def test_a_result_says_what_made_it_and_is_stale_by_the_file_that_differs(tmp_path):
    assert read_result("one", tmp_path) is None
    found = {"seconds": 1.0, "settings": {}, "figures": [["a", 2.0], ["b", None]]}
    (tmp_path / "one.json").write_text(written(provenance((MODULE,)) | found))
    result = read_result("one", tmp_path)
    assert result["figures"] == [["a", 2.0], ["b", None]]
    assert len(result["commit"]) == 40
    assert set(result["versions"]) == {"python", "numpy", "numba", "scipy", "gymnasium"}
    assert changed(result, (MODULE,)) == []
    assert not {path for path in result["sources"] if path.startswith("tests/") or path == "lab/studies/door.py"}
    result["sources"]["baselines/registry.py"] = "0"
    del result["sources"]["baselines/staged.py"]
    assert changed(result, (MODULE,)) == ["baselines/registry.py", "baselines/staged.py"]


def test_a_package_that_a_result_depends_on_names_none_of_a_later_one_for_it():
    """``birthsim_env.registry`` names rooms above it, which count for what imports them alone."""
    assert not any(path.startswith("agents/") for path in hashes("birthsim_env.registry"))
    assert "agents/residual/env.py" in hashes("agents")


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
def test_every_declared_study_measures_with_files_that_there_are_and_has_a_state(name):
    study = shelf.declared(name)
    assert all(f"{module.replace('.', '/')}.py" in hashes(*study.code) for module in study.code)
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
    monkeypatch.setattr(shelf, "PAGES", (tmp_path / "README.md",))
    (tmp_path / "README.md").write_text("no table")
    monkeypatch.setattr(shelf, "ROOT", tmp_path)
    shelf.render()
    assert {path.name: path.read_text() for path in tmp_path.iterdir() if path.name != "README.md"} == expected


def test_status_lists_every_study(monkeypatch, capsys):
    status, printed, _ = call("study", monkeypatch, capsys, "status")
    assert (status, [line.split()[0] for line in printed.splitlines()]) == (0, shelf.names())
