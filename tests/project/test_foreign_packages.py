"""Another package named ``agents`` or ``baselines`` in the way: one line that says where it is and how to mend it."""

import subprocess
import sys

import pytest

from birthsim import shadows
from tests.console import ROOT

PACKAGES = ("agents", "baselines")
MEND = "rename or uninstall it, then pip install --force-reinstall --no-deps -e . in a clone"
COMMAND = "import sys; sys.argv = ['birthsim', {!r}, '--help']; from birthsim.main import main; main()"
USES = {
    "a command that is slow to load": COMMAND.format("tune"),
    "a command whose help is quick": COMMAND.format("evaluate"),
    "a name": "from birthsim import make_controller",
    "another name": "import birthsim; birthsim.Parameters",
}


def run(script, folder):
    paths = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]; "
    return subprocess.run([sys.executable, "-c", paths + script], capture_output=True, text=True, timeout=300, check=False)


def foreign(folder, package, content="raise RuntimeError('a foreign package was run')\n"):
    (folder / package).mkdir()
    (folder / package / "__init__.py").write_text(content, encoding="utf-8")
    return folder / package


@pytest.mark.parametrize("package", PACKAGES)
@pytest.mark.parametrize("use", USES)
def test_a_foreign_package_is_named_and_not_run(use, package, tmp_path):
    place = foreign(tmp_path, package)
    done = run(USES[use], tmp_path)
    said = done.stderr.strip().splitlines()
    assert [part for part in (repr(package), str(place), MEND) if part not in said[-1]] == []
    assert "a foreign package was run" not in done.stderr
    assert (done.returncode, len(said)) == (2, 1) if "main()" in USES[use] else done.returncode != 0


def test_the_doctor_says_what_hides_what(tmp_path):
    places = [str(foreign(tmp_path, package)) for package in PACKAGES]
    done = run(COMMAND.format("doctor").replace(", '--help'", ""), tmp_path)
    assert done.returncode == 0, done.stderr
    lines = {line.split()[0]: line for line in done.stdout.partition("\nextras\n")[0].splitlines()}
    for package, place in zip(PACKAGES, places, strict=True):
        assert place in lines[package]
        assert MEND in lines[package]


def test_help_of_all_commands_needs_neither(tmp_path):
    for package in PACKAGES:
        foreign(tmp_path, package)
    done = run(COMMAND.format("--help"), tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_package_that_was_installed_over_ours_is_foreign(tmp_path, monkeypatch):
    """Two distributions may put files into one folder; the later one's ``__init__.py`` stays."""
    place = foreign(tmp_path, "agents", "VERSION = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(shadows, "ROOT", tmp_path)
    monkeypatch.setattr(shadows, "NAMES", ("agents",))
    monkeypatch.delitem(sys.modules, "agents", raising=False)
    assert shadows.shadows() == {"agents": str(place)}
    (place / "__init__.py").write_text((ROOT / "agents" / "__init__.py").read_text(encoding="utf-8"), encoding="utf-8")
    assert shadows.shadows() == {}


def test_the_registry_leaves_foreign_packages_out_and_says_so(tmp_path):
    place = foreign(tmp_path, "agents")
    use = "from baselines import make_controller; make_controller({!r})"
    done = run(use.format("pid"), tmp_path)
    assert done.returncode == 0, done.stderr
    done = run(use.format("residual"), tmp_path)
    said = done.stderr.strip().splitlines()[-1]
    assert "controller = 'residual'" in said
    assert str(place) in said


@pytest.mark.parametrize("package", PACKAGES)
def test_a_folder_without_a_module_hides_nothing(package, tmp_path):
    (tmp_path / package).mkdir()
    (tmp_path / package / "notes.txt").touch()
    done = run(COMMAND.format("explain"), tmp_path)
    assert done.returncode == 0, done.stderr
