"""Hashes, versions and licences of what the project is made of; the pages and workflows that speak of it."""

import hashlib
import json
import re
import tomllib
from pathlib import Path

import pytest
import yaml

import birthsim_env
from birthsim.main import COMMANDS
from tests.console import ROOT

LOCKS = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "packaging" / "requirements").glob("*.txt")}
PINS = {name: dict(re.findall(r"^([A-Za-z0-9._-]+)==([^\s;]+)", text, re.MULTILINE)) for name, text in LOCKS.items()}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# sha256sum of dist/ and LICENSE in npm's uplot-1.6.32.tgz
UPLOT = {
    "uPlot.LICENSE": "8f989229699b4fe2f1a0432d0e9edc338a8a911e250e2d1b01ecd770a5f5b1bd",
    "uPlot.esm.js": "5dd9b3281aa64b461b42d9945f6adb2649d346502b12281a9ae0d46599a80eba",
    "uPlot.min.css": "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04",
}


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def constraints():
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return {plain(name): version for name, _, version in (line.partition("==") for line in lines) if version}


def test_the_lock_holds_every_constraint_and_nothing_else_on_linux():
    locked = {plain(name): version for name, version in PINS["project"].items()}
    others = r"^([\w.-]+)==.* (?:sys_platform == '(?:win32|emscripten|darwin)'|implementation_name == 'pypy')"
    elsewhere = re.findall(others, LOCKS["project"], re.MULTILINE)
    here = {name: version for name, version in locked.items() if name not in elsewhere}
    assert here | {"torch": constraints()["torch"]} == constraints()


@pytest.mark.parametrize("name", LOCKS)
def test_every_requirement_has_hashes(name):
    entries = re.split(r"\n(?=[A-Za-z0-9])", re.sub(r"^#.*\n", "", LOCKS[name], flags=re.MULTILINE))
    assert len(entries) > 1
    assert [entry.split()[0] for entry in entries if "--hash=sha256:" not in entry] == []


def test_pytorch_comes_without_cuda():
    assert [name for name in PINS["project"] if re.match(r"torch$|triton|nvidia|cuda", name)] == []
    versions = re.findall(r"^torch==(\S+)", LOCKS["torch"], re.MULTILINE)
    assert versions == [f"{constraints()['torch']}+cpu", constraints()["torch"]]
    assert PINS["torch-cuda"]["torch"] == constraints()["torch"]


def test_every_dependency_of_the_project_is_locked():
    wanted = [*PROJECT["dependencies"], *(one for extra in PROJECT["optional-dependencies"].values() for one in extra)]
    names = {plain(re.match(r"[\w.-]+", one)[0]) for one in wanted}
    # PyTorch has a file of its own; make installs no cluster, and nothing for a GPU.
    assert names - {plain(name) for name in PINS["project"]} == {"torch", "ray", "cupy-cuda12x", "nvidia-cuda-nvcc-cu12"}


def test_the_papers_of_a_release_agree():
    """CITATION.cff, codemeta.json and the conda recipe with the package; the recipe asks for what pyproject.toml asks for."""
    recipe = yaml.safe_load((ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
    codemeta = json.loads((ROOT / "packaging" / "codemeta.json").read_text(encoding="utf-8"))
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {citation["version"], codemeta["version"], recipe["context"]["version"]} == {birthsim_env.__version__}
    asked = {one.replace(" ", "").replace("-base", "") for one in recipe["requirements"]["run"]}
    assert asked == {*PROJECT["dependencies"], f"python{PROJECT['requires-python']}"}
    assert (codemeta["description"], codemeta["keywords"]) == (PROJECT["description"], PROJECT["keywords"])


def test_what_is_vendored_is_the_published_package():
    folder = ROOT / "birthsim_live" / "page" / "vendor"
    assert {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()} == UPLOT
    named = (ROOT / "packaging" / "THIRD_PARTY.md").read_text(encoding="utf-8")
    version = re.search(r"\(v([\d.]+)\)", (folder / "uPlot.esm.js").read_text(encoding="utf-8"))[1]
    assert [name for name in UPLOT if name not in named] == []
    assert f"| {version} | MIT" in named


@pytest.mark.parametrize("path", sorted((ROOT / ".github" / "workflows").glob("*.yml")), ids=lambda path: path.stem)
def test_a_workflow_runs_what_there_is_and_pins_its_actions(path):
    jobs = yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"].values()
    steps = [step for job in jobs for step in job["steps"]]
    assert [step["uses"] for step in steps if "uses" in step and not re.search(r"@[0-9a-f]{40}$", step["uses"])] == []
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    runs = "\n".join(step.get("run", "") for step in steps)
    assert {name for names in re.findall(r"\bmake ([a-z-]+(?: [a-z-]+)*)", runs) for name in names.split()} <= targets


def test_the_changelog_is_in_its_order_and_names_commands_that_exist():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    *later, first = text.split("\n## ")[1:]
    for version in later:
        assert re.findall(r"^### (.*)$", version, re.MULTILINE) == ["Added", "Changed", "Fixed"]
    assert first.startswith("0.1.0")
    line = next(line for line in first.splitlines() if line.startswith("- `birthsim run`"))
    assert {name.removeprefix("birthsim ") for name in re.findall(r"`([^`]+)`", line)} == {*COMMANDS} - {"study"}


def test_the_headers_of_the_fmi_standard_are_unchanged():
    fmpy = pytest.importorskip("fmpy")
    theirs = Path(fmpy.__file__).parent / "c-code"
    ours = list((ROOT / "birthsim_build" / "fmu" / "fmi_headers").glob("*.h"))
    assert len(ours) == 6
    assert [path.name for path in ours if path.read_bytes() != (theirs / path.name).read_bytes()] == []
