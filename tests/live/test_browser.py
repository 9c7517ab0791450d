"""Where a Chromium is looked for, what is said where there is none, and that CI does not skip the page in silence."""

import os
import subprocess
import sys

import pytest

from tests.console import ROOT
from tests.live import browser

LACK = f"the page's tests need Chromium ({browser.INSTALLATION})"
PATTERNS = [
    "cache:chromium-1228/chrome-linux/chrome",
    "cache:chromium-1228/chrome-linux64/chrome",
    "cache:chromium_headless_shell-1228/chrome-linux/headless_shell",
    "cache:chromium_headless_shell-1228/chrome-headless-shell-linux64/chrome-headless-shell",
    "Library/Caches/ms-playwright/chromium-1228/chrome-mac/Chromium.app/Contents/MacOS/Chromium",
    "Library/Caches/ms-playwright/chromium-9/chrome-mac-arm64/Google Chrome for Testing.app/Contents/MacOS/Google Chrome",
    "AppData/Local/ms-playwright/chromium-1228/chrome-win64/chrome.exe",
    "AppData/Local/ms-playwright/chromium_headless_shell-1228/chrome-headless-shell-win64/chrome-headless-shell.exe",
]


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


@pytest.mark.parametrize("name", browser.NAMES)
def test_every_name_is_found_in_the_path_and_in_the_usual_places(bare, name):
    placed = program(bare / "place" / name)
    assert browser.find_chromium() == placed
    first = program(bare / "bin" / name)
    assert browser.find_chromium() == first


@pytest.mark.parametrize("pattern", PATTERNS)
def test_what_playwright_downloads_is_found(bare, pattern):
    path = program(bare / pattern.replace("cache:", ".cache/ms-playwright/"))
    assert browser.find_chromium() == path


def test_playwrights_own_variable_and_the_cache_of_the_desktop_are_heeded(bare, monkeypatch):
    old = program(bare / "cache" / "ms-playwright" / "chromium-998" / "chrome-linux" / "chrome")
    monkeypatch.setenv("XDG_CACHE_HOME", str(bare / "cache"))
    assert browser.find_chromium() == old
    own = program(bare / "own" / "chromium-7" / "chrome-linux" / "chrome")
    monkeypatch.setenv("PLAYWRIGHT_BROWSERS_PATH", str(bare / "own"))
    assert browser.find_chromium() == own


def test_of_several_downloads_the_newest_and_only_programs_count(bare):
    cache = bare / ".cache" / "ms-playwright"
    program(cache / "chromium-998" / "chrome-linux" / "chrome")
    newest = program(cache / "chromium_headless_shell-1228" / "chrome-linux" / "headless_shell")
    (cache / "chromium-2000" / "chrome-linux").mkdir(parents=True)
    (cache / "chromium-2000" / "chrome-linux" / "chrome").touch(0o644)
    assert browser.find_chromium() == newest


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
