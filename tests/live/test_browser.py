"""What is said where there is no Chromium, and that CI does not skip the page in silence."""

import os
import subprocess
import sys

import pytest

from tests.console import ROOT
from tests.live import browser

LACK = f"the page's tests need Chromium ({browser.INSTALLATION})"


def test_what_is_missing_is_named_with_the_command_that_installs_it(tmp_path, monkeypatch):
    """On a machine without any browser, and then with one."""
    pytest.importorskip("playwright")
    for name in ("BIRTHSIM_CHROMIUM", "PLAYWRIGHT_BROWSERS_PATH", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    assert browser.missing() == LACK
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "chromium").touch(0o755)
    assert browser.missing() == ""
    monkeypatch.setenv("BIRTHSIM_CHROMIUM", str(tmp_path / "none"))
    with pytest.raises(ValueError, match=r"BIRTHSIM_CHROMIUM = '.*none' is no program; allowed: the path of a Chromium"):
        browser.find_chromium()


@pytest.mark.slow
@pytest.mark.parametrize("ci", [False, True])
def test_without_a_browser_the_last_line_says_so_and_in_ci_it_fails(ci, tmp_path):
    (tmp_path / "hidden.py").write_text("from tests.live import browser\nbrowser.find_chromium = lambda: None\n")
    line = [sys.executable, "-m", "pytest", "-n1", "-p", "hidden", "-p", "no:cacheprovider", "-k", "slow_motion"]
    given = {name: value for name, value in os.environ.items() if name != "CI" and not name.startswith("PYTEST_")}
    given |= {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])} | ({"CI": "true"} if ci else {})
    line.append("tests/live/page/test_access.py")
    done = subprocess.run(line, cwd=ROOT, env=given, capture_output=True, text=True, check=False)
    assert (done.returncode != 0) == ci, done.stderr
    if ci:
        assert f"CI=true, and {LACK}" in done.stdout
    else:
        assert done.stdout.splitlines()[-1] == f"THE PAGE WAS NOT TESTED, 1 tests were skipped: {LACK}"
