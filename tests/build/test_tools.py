"""External tools run where a user has no home, or one that nothing can be written to."""

import sys
from pathlib import Path

import pytest

from birthsim_build.code import tools
from birthsim_build.code.tools import run_tool, tool_environment
from birthsim_env.physics.compiled.sources import files_of
from tests.build.targets import need_linker

SAID = "import os; print(os.environ['HOME'], os.environ['XDG_CACHE_HOME'])"
HOMES = ("HOME", "XDG_CACHE_HOME", "ZIG_GLOBAL_CACHE_DIR")


@pytest.fixture
def homeless(monkeypatch, tmp_path):
    """A process without any of these variables, whose cache is a folder of its own."""
    for name in HOMES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(tools, "cache_folder", lambda: tmp_path / "kept")
    return monkeypatch


@pytest.mark.parametrize("home", [None, "", "/proc", "/dev/null", "relative", "/nonexistent/home"])
def test_without_a_home_tools_have_a_folder_that_stays(home, homeless, tmp_path):
    if home is not None:
        homeless.setenv("HOME", home)
    done = run_tool(sys.executable, "-c", SAID)
    places = [Path(text) for text in done.stdout.split()]
    assert places == [tmp_path / "kept" / "tools", tmp_path / "kept" / "tools" / "cache"]
    assert all(place.is_dir() for place in places)


def test_a_home_of_ones_own_is_left_alone(homeless, tmp_path):
    homeless.setenv("HOME", str(tmp_path))
    with tool_environment() as environment:
        assert environment["HOME"] == str(tmp_path)
        assert "ZIG_GLOBAL_CACHE_DIR" not in environment


def test_where_nothing_can_be_kept_the_folder_goes_again(homeless):
    homeless.setattr(tools, "cache_folder", lambda: None)
    with tool_environment() as environment:
        assert Path(environment["XDG_CACHE_HOME"]).is_dir()
    assert not Path(environment["HOME"]).exists()


def test_zig_compiles_without_a_home(homeless, tmp_path):
    need_linker()
    (tmp_path / "one.c").write_text("int one(void) { return 1; }\n")
    line = (sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-linux-gnu.2.17", "-c", "one.c", "-o", "one.o")
    done = run_tool(*(str(tmp_path / word) if word in ("one.c", "one.o") else word for word in line))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "one.o").stat().st_size > 0


def test_only_this_place_runs_programs_of_others():
    """Of the packages: what else runs is Python itself, which compiles."""
    packages = ("birthsim", "birthsim_env", "birthsim_build", "birthsim_drive", "birthsim_live", "baselines", "agents")
    files = files_of(*packages)
    runs = {f"{path.parent.name}/{path.name}" for path in files if "import subprocess" in path.read_text(encoding="utf-8")}
    assert runs == {"code/tools.py", "code/compiler.py", "kernels/__main__.py", "kernels/recording.py"}
