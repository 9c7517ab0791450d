"""A page without a server: what cannot be made is refused before anything is written."""

from tests.build.targets import need_linker
from tests.console import call


def test_a_rig_that_the_page_cannot_show_is_refused(tmp_path, monkeypatch, capsys):
    need_linker()
    (tmp_path / "rig.toml").write_text("[valves]\ndeadband = 0.02\n")
    options = ("--static", tmp_path / "page", "--parameters", tmp_path / "rig.toml")
    status, _, complained = call("live", monkeypatch, capsys, *options)
    assert status == 2
    assert "imperfect valves" in complained.splitlines()[-1]
    assert not (tmp_path / "page").exists()


def test_a_folder_with_something_in_it_is_refused(tmp_path, monkeypatch, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    status, _, complained = call("live", monkeypatch, capsys, "--static", tmp_path)
    assert status == 2
    assert complained.endswith(f"--static '{tmp_path}' is not empty; allowed: a new or empty folder\n")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
