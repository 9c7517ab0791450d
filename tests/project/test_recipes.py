"""CONTRIBUTING's recipes, performed in a tree of their own: files are counted, and what lists things knows the new one."""

import os
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from birthsim_env.physics.compiled.kept import cache_folder
from tests.console import ROOT

RECIPES = Path(__file__).parent / "recipes"


class Recipe(NamedTuple):
    """What a recipe adds, which tests of the tree must take it by themselves, and commands that must say its name."""

    name: str
    tests: tuple[str, ...] = ()
    least: int = 0
    said: tuple[tuple[str, ...], ...] = ()

    @property
    def chosen(self):
        """Those tests that say the name of a part; completeness takes all parameters in one."""
        return () if self.tests == ("tests/oracles/test_completeness.py",) else ("-k", self.name)


DOCS = "import sys; sys.path.insert(0, 'docs'); from _generate import PARTS; print(PARTS[{!r}]())"
CONTRACTS = ("tests/contracts/test_controllers.py", "tests/contracts/test_bad_samples.py", "tests/contracts/test_copies.py")
ADDED = {
    "controller": Recipe(
        "force-pd",
        (*CONTRACTS, "tests/build/test_bits.py"),
        12,
        (("-m", "birthsim", "evaluate", "--help"), ("-m", "birthsim", "run", "--controller", "force-dp", "--out", "x")),
    ),
    "sensor": Recipe("camera", CONTRACTS[:1], 12, (("-m", "birthsim", "run", "--sensors", "no", "--out", "x"),)),
    "scenario": Recipe("crowning", ("tests/contracts/test_environments.py",), 2),
    "parameter": Recipe("quadratic_friction", ("tests/oracles/test_completeness.py",), 1),
    "study": Recipe("lab-sensors", said=(("-m", "birthsim", "study", "--help"),)),
}
PAGES = {"controller": "controllers.md", "sensor": "sensors.md", "scenario": "environments.md", "parameter": "rig.md"}
"""Recipe -> the generated part of the documentation that has a row of it."""


def files_of(recipe):
    """The files that a recipe adds or changes, as the tree names them."""
    diffs = list((RECIPES / recipe).glob("*.diff"))
    if diffs:
        return [
            line for diff in diffs for line in re.findall(r"^\+\+\+ b/(.*)$", diff.read_text(encoding="utf-8"), re.MULTILINE)
        ]
    folder = RECIPES / recipe
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.suffix in (".py", ".c", ".md"))


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """What git tracks here, and the machine code of kernels that are as here."""
    place = tmp_path_factory.mktemp("trees") / "plain"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, place / name)
    cache = cache_folder()
    if cache is not None:
        shutil.copytree(cache, place / "birthsim_env" / "__pycache__", copy_function=os.link, dirs_exist_ok=True)
    return place


@pytest.fixture(scope="module")
def performed(tree, tmp_path_factory):
    """The tree after a recipe, by its name: a copy, in which what is compiled for one test is there for the next."""
    return cache(lambda recipe: _performed(recipe, tree, tmp_path_factory.mktemp(recipe) / "tree"))


def _performed(recipe, tree, place):
    shutil.copytree(tree, place, copy_function=os.link)
    for name in files_of(recipe):
        (place / name).unlink(missing_ok=True)  # a link to the file of the plain tree
        if (tree / name).is_file():
            shutil.copy(tree / name, place / name)
    for diff in (RECIPES / recipe).glob("*.diff"):
        subprocess.run(["git", "apply", "--unidiff-zero", str(diff)], cwd=place, check=True)
    for name in files_of(recipe):
        if (RECIPES / recipe / name).is_file():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(RECIPES / recipe / name, place / name)
    return place


def run_in(place, *words):
    """What Python prints in a tree, and its status."""
    environment = {**os.environ, "PYTHONPATH": str(place), "NUMBA_CACHE_DIR": str(place / "birthsim_env" / "__pycache__")}
    environment = {name: value for name, value in environment.items() if not name.startswith(("PYTEST_", "COV_"))}
    done = subprocess.run([sys.executable, *words], cwd=place, env=environment, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def told():
    """Recipe -> files to touch and files to read, as CONTRIBUTING says."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| an? (\w+) \| (\d+) \| (.*) \|$", text, re.MULTILINE)
    return {name: (int(count), re.findall(r"`([^`]+)`", read)) for name, count, read in rows}


def test_the_recipes_that_are_told_are_those_that_are_performed():
    assert set(told()) == set(ADDED) == {path.name for path in RECIPES.iterdir() if path.is_dir() and path.name[0] not in "._"}


@pytest.mark.parametrize("recipe", ADDED)
def test_a_recipe_touches_and_reads_what_is_told(recipe):
    count, read = told()[recipe]
    assert len(files_of(recipe)) == count
    assert len(read) <= 5
    assert [name for name in read if not (ROOT / name).is_file()] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "recipe", [pytest.param(name, marks=pytest.mark.weekly if name in ("scenario", "parameter") else ()) for name in ADDED]
)
def test_a_recipe_is_all_that_it_takes(recipe, performed):
    added, place = ADDED[recipe], performed(recipe)
    own = [name for name in files_of(recipe) if Path(name).name.startswith("test_")]
    for tests, chosen, least in ((own, (), 1), (added.tests, added.chosen, added.least)):
        if tests:
            status, said = run_in(place, "-m", "pytest", "-p", "no:cacheprovider", *tests, *chosen)
            assert status == 0, said[-3000:]
            assert int(re.search(r"(\d+) passed", said)[1]) >= least
    for words in added.said:
        assert added.name in run_in(place, *words)[1]
    if recipe in PAGES:
        status, said = run_in(place, "-c", DOCS.format(PAGES[recipe]))
        assert status == 0, said
        assert added.name.lower() in said.lower()


@pytest.mark.slow
@pytest.mark.weekly
def test_a_controller_that_is_registered_makes_no_result_stale(tree, performed):
    line = ("-m", "birthsim", "study", "status")
    (status, said), (plain, before) = (run_in(place, *line) for place in (performed("controller"), tree))
    assert (status, plain) == (0, 0), said + before
    assert re.search(r"; lacks .*\bforce-pd\b", said)  # of what measures every controller
    assert re.sub(r"; lacks force-pd$|\bforce-pd, |, force-pd\b", "", said, flags=re.MULTILINE) == before


@pytest.mark.slow
def test_a_parameter_that_an_oracle_does_not_know_fails_a_test_that_names_both(tree, performed, tmp_path):
    place = tmp_path / "tree"
    shutil.copytree(performed("parameter"), place, copy_function=os.link)
    shutil.copy(tree / "lab" / "studies" / "accuracy" / "second_model.py", place / "second_model.py")
    os.replace(place / "second_model.py", place / "lab" / "studies" / "accuracy" / "second_model.py")
    status, said = run_in(place, "-m", "pytest", "-p", "no:cacheprovider", "tests/oracles/test_completeness.py")
    assert status == 1
    assert "friction.quadratic_friction" in said
    assert "second_model" in said
