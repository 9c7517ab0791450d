"""Where a Chromium is looked for, what is said where there is none, and that CI does not skip the page in silence."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.console import ROOT
from tests.live import browser

LACK = f"the page's tests need Chromium ({browser.INSTALLATION})"


@pytest.fixture
def bare(tmp_path, monkeypatch):
    """A machine without any browser, whose home is a temporary folder."""
    for name in ("BIRTHSIM_CHROMIUM", "PLAYWRIGHT_BROWSERS_PATH", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setattr(browser, "PLACES", (str(tmp_path / "place"),))
    assert browser.find_chromium() is None
    return tmp_path


def program(path):
    """An executable file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch(0o755)
    return str(path)


@pytest.mark.parametrize("name", ["chromium", "google-chrome"])
def test_a_name_is_found_in_the_path_and_in_the_usual_places(bare, name):
    placed = program(bare / "place" / name)
    assert browser.find_chromium() == placed
    first = program(bare / "bin" / name)
    assert browser.find_chromium() == first


def test_what_playwright_downloads_is_found(bare, monkeypatch):
    monkeypatch.setenv("PLAYWRIGHT_BROWSERS_PATH", str(bare / "own"))
    line = [sys.executable, "-c", browser.OF_PLAYWRIGHT]
    place = Path(subprocess.run(line, capture_output=True, text=True, check=True).stdout.strip())
    assert place.is_relative_to(bare / "own")
    program(place)
    assert browser.find_chromium() == str(place)


def test_the_variable_names_another_and_must_name_a_program(bare, monkeypatch):
    program(bare / "bin" / "chromium")
    own = program(bare / "mine")
    monkeypatch.setenv("BIRTHSIM_CHROMIUM", own)
    assert browser.find_chromium() == own
    monkeypatch.setenv("BIRTHSIM_CHROMIUM", str(bare / "none"))
    with pytest.raises(ValueError, match=r"BIRTHSIM_CHROMIUM = '.*none' is no program; allowed: the path of a Chromium"):
        browser.find_chromium()


def test_what_is_missing_is_named_with_the_command_that_installs_it(bare):
    pytest.importorskip("playwright")
    assert browser.missing() == LACK
    program(bare / "bin" / "chromium")
    assert browser.missing() == ""


@pytest.mark.slow
@pytest.mark.parametrize("ci", [False, True])
def test_without_a_browser_the_last_line_says_so_and_in_ci_it_fails(ci, tmp_path):
    (tmp_path / "hidden.py").write_text("from tests.live import browser\nbrowser.find_chromium = lambda: None\n")
    line = [sys.executable, "-m", "pytest", "-n1", "-p", "hidden", "-p", "no:cacheprovider", "-k", "slow_motion"]
    given = {name: value for name, value in os.environ.items() if name != "CI" and not name.startswith("PYTEST_")}
    given |= {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])} | ({"CI": "true"} if ci else {})
    done = subprocess.run(
        [*line, "tests/live/page/test_page.py"], cwd=ROOT, env=given, capture_output=True, text=True, check=False
    )
    assert (done.returncode != 0) == ci, done.stderr
    if ci:
        assert f"CI=true, and {LACK}" in done.stdout
    else:
        assert done.stdout.splitlines()[-1] == f"THE PAGE WAS NOT TESTED, 1 tests were skipped: {LACK}"
