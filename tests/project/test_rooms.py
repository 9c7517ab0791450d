"""What a user imports is importable from the packages, wherever it lives."""

import ast
import re
import subprocess
import sys
from fnmatch import fnmatch

import pytest

import agents
import baselines
import birthsim_env
from birthsim_env.physics.compiled.sources import files_of
from tests.console import ROOT


@pytest.mark.parametrize("package", [agents, baselines, birthsim_env])
def test_every_public_name_is_there(package):
    assert len(package.__all__) > 5
    assert sorted(package.__all__) == sorted(getattr(package, "_PLACES", package.__all__))
    for name in package.__all__:
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'Nobody'"):
        _ = package.Nobody


def test_importing_a_package_loads_no_torch():
    script = "import sys, agents, baselines, birthsim_env; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=True)
    assert done.stdout.strip() == "False"


def test_no_folder_of_tests_is_left_out(pytestconfig):
    """Of itself pytest goes into none that is named build."""
    left_out, folders = pytestconfig.getini("norecursedirs"), {path.parent for path in (ROOT / "tests").rglob("test_*.py")}
    parts = {part for folder in folders for part in folder.relative_to(ROOT).parts}
    assert {"build", "physics"} <= parts
    assert [part for part in parts if any(fnmatch(part, pattern) for pattern in left_out)] == []


def test_no_module_gives_a_name_twice():
    """A later constant or function of the same name would take the place of the first without a word."""
    twice = []
    for path in files_of("birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_drive", "birthsim_live"):
        named = set()
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            targets = [] if isinstance(node, ast.For) else getattr(node, "targets", [getattr(node, "target", node)])
            parts = [part for target in targets for part in getattr(target, "elts", [target])]
            names = [getattr(part, "id", getattr(part, "name", None)) for part in parts]
            twice += [f"{path.relative_to(ROOT)}: {name}" for name in names if name in named]
            named.update(filter(None, names))
    assert twice == []


def _assigned(function):
    """Name and value of every assignment in a function, those of tuples one by one."""
    for node in ast.walk(function):
        for target in node.targets if isinstance(node, ast.Assign) else []:
            both = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
            yield from zip(target.elts, node.value.elts, strict=True) if both else [(target, node.value)]


def rows_by_number(source):
    """Subscripts of kernels whose row is written with a number: ``x[12, i]``, ``own[8:10]``, ``rows[36 + k, i]``.

    Rows of a named group are told apart by number: ``seen.force[0, i]`` does not count, nor ``f[0, i]`` after
    ``f = seen.force``.
    """
    for function in ast.walk(ast.parse(source)):
        decorators = {one.id for one in getattr(function, "decorator_list", []) if isinstance(one, ast.Name)}
        if not decorators & {"kernel", "helper"}:
            continue
        named = {one.id for one, value in _assigned(function) if isinstance(one, ast.Name) and isinstance(value, ast.Attribute)}
        for node in (one for one in ast.walk(function) if isinstance(one, ast.Subscript)):
            is_named = isinstance(node.value, ast.Attribute) or getattr(node.value, "id", None) in named
            row = node.slice.elts[0] if isinstance(node.slice, ast.Tuple) else node.slice
            if not is_named and any(isinstance(one, ast.Constant) and type(one.value) is int for one in ast.walk(row)):
                yield ast.unparse(node)


def test_rows_by_number_are_found():
    body = "f, g = seen.force, s[8:10]\n  x[12, i] = rows[36 + k, i] + f[0, i] + seen.force[1, i] + x[ROW, i]"
    assert sorted(rows_by_number(f"@kernel\ndef k(x):\n  {body}")) == ["rows[36 + k, i]", "s[8:10]", "x[12, i]"]
    assert not list(rows_by_number(f"def k(x):\n  {body}"))


GIVEN = {
    "baselines/estimation/hand/quiet_force.py": {f"{name}[{axis}, i]" for name in ("force", "found") for axis in (0, 1)},
    "agents/residual/corrected.py": {"action[valve - 2 * first, i]"},
    "baselines/bench/metrics.py": {"command[0, i]", "command[1, i]"},
    "baselines/estimation/hand/bristle_filter.py": {"_yielding(_way(v) * z / slack, law)[0]"},
    "baselines/estimation/friction_observer.py": {"start[0]", "start[1]"},
    "baselines/estimation/hand/bristled_pistons.py": {"pose[5]"},
    "baselines/estimation/stages.py": {"scratch(1)[0, :n]"},
    "baselines/estimation/rig_reader.py": {
        "singles(tables, 0)[lane:lane + 1]",
        "observed[0]",
        "observed[place + 2 * SIZE + a]",
        "observed[place + 2 * SIZE + READ]",
    },
    "birthsim_env/observation.py": {"scales[each * k + each - 1]", "pair[1]", "pair[0]"},
    "baselines/estimation/dry_friction.py": {"pressures[2 * cylinder, i]", "pressures[2 * cylinder + 1, i]"},
    "baselines/identification/windows/tracks.py": {"known[0, i]", "known[1 + k, i]", "flows[4 + k, i]"},
    "lab/studies/bandwidth/valves.py": {"pressures[2 * k, 0]", "pressures[2 * k + 1, 0]"},
}
"""Arguments that are one named group of whoever calls: x and y, or chambers P1, N1, P2, N2. In tracks.py: the supply's
pressure and then those of the tubes' ends; flows from the supply and then those to the atmosphere, (8, N). In corrected.py and
observation.py: entries of a rail, which begin with cylinder 2. In rig_reader.py: a lane of a table, and what it sees. pose,
start and _yielding are tuples."""


def test_kernels_name_their_rows():
    found = []
    for path in files_of("birthsim_env", "baselines", "agents", "lab"):
        place = path.relative_to(ROOT).as_posix()
        if "/physics/" not in place and not place.startswith("birthsim_env/gradients/"):
            by_number = set(rows_by_number(path.read_text(encoding="utf-8")))
            found += [f"{place}: {row}" for row in by_number - GIVEN.get(place, set())]
    assert found == []


def test_packages_are_walked_by_what_leaves_kept_code_alone():
    """Below ``__pycache__`` files come and go: a plain walk fails at a bad moment, so that ``files_of`` is the only one."""
    walking = re.compile(r"rglob\([\"']\*\.py[\"']\)")
    packages = (
        "birthsim",
        "birthsim_env",
        "birthsim_build",
        "birthsim_drive",
        "birthsim_live",
        "baselines",
        "agents",
        "lab",
        "docs",
        "tests",
    )
    assert [path for path in files_of(*packages) if walking.search(path.read_text(encoding="utf-8"))] == []
