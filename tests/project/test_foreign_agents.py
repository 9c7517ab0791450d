"""Another package named ``agents`` in the way: one line that says where it is and how to mend it."""

import subprocess
import sys

import pytest

from tests.console import ROOT

MAKE = "import gymnasium, birthsim_env; gymnasium.make{}('BirthSIM/CircleResidual-v1')"
COMMAND = "import sys; sys.argv = ['birthsim', 'explain', '--help']; from birthsim.door import main; main()"


def run(script, folder):
    paths = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]; "
    return subprocess.run([sys.executable, "-c", paths + script], capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.parametrize(
    ("script", "content"),
    [
        (COMMAND, ""),
        (COMMAND, "import nothing_of_the_kind\n"),
        (COMMAND, None),
        (MAKE.format(""), ""),
        (MAKE.format("_vec"), "import nothing_of_the_kind\n"),
        pytest.param(MAKE.format(""), None, marks=pytest.mark.slow),
    ],
)
def test_a_foreign_package_is_named(script, content, tmp_path):
    (tmp_path / "agents").mkdir()
    if content is not None:
        (tmp_path / "agents" / "__init__.py").write_text(content, encoding="utf-8")
    else:
        # A folder without __init__.py hides nothing that has one.
        (tmp_path / "agents" / "notes.txt").write_text("", encoding="utf-8")
    done = run(script, tmp_path)
    said = done.stderr.strip().splitlines()[-1] if done.stderr.strip() else ""
    if content is None:
        assert done.returncode == 0, done.stderr
        return
    assert done.returncode != 0
    assert "rename or uninstall it, then pip install --force-reinstall --no-deps birthsim" in said
    assert (str(tmp_path) in said) if content == "" else ("nothing_of_the_kind" in said)
    if script == COMMAND:
        assert len(done.stderr.strip().splitlines()) == 1
        assert done.returncode == 2
