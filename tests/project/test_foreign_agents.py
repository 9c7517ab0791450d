"""Another package named ``agents`` in the way: one line that says where it is and how to mend it."""

import subprocess
import sys

import pytest

from tests.console import ROOT

MAKE = "import gymnasium, birthsim_env; gymnasium.make{}('BirthSIM/CircleResidual-v1')"
COMMAND = "import sys; sys.argv = ['birthsim', 'explain', '--help']; from birthsim.main import main; main()"


def run(script, folder):
    paths = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]; "
    return subprocess.run([sys.executable, "-c", paths + script], capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.parametrize("content", ["", "import nothing_of_the_kind\n"])
@pytest.mark.parametrize("script", [COMMAND, MAKE.format(""), MAKE.format("_vec")], ids=["command", "make", "make_vec"])
def test_a_foreign_package_is_named(script, content, tmp_path):
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "__init__.py").write_text(content, encoding="utf-8")
    done = run(script, tmp_path)
    said = done.stderr.strip().splitlines()
    assert "rename or uninstall it, then pip install --force-reinstall --no-deps -e . in a clone" in said[-1]
    assert ("nothing_of_the_kind" if content and script != COMMAND else str(tmp_path)) in said[-1]
    assert (done.returncode, len(said)) == (2, 1) if script == COMMAND else done.returncode != 0


@pytest.mark.parametrize("script", [COMMAND, pytest.param(MAKE.format(""), marks=pytest.mark.slow)])
def test_a_folder_without_a_module_hides_nothing(script, tmp_path):
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "notes.txt").touch()
    done = run(script, tmp_path)
    assert done.returncode == 0, done.stderr
