"""What a user imports is importable from the packages, wherever it lives."""

from __future__ import annotations

import ast
import pathlib
import subprocess
import sys

import pytest

import agents
import baselines
import birthsim_env


@pytest.mark.parametrize("package", [agents, baselines, birthsim_env])
def test_every_public_name_is_there(package):
    assert len(package.__all__) > 5
    for name in package.__all__:
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'Nobody'"):
        _ = package.Nobody


@pytest.mark.parametrize("package", [agents, baselines])
def test_the_list_is_that_of_the_places(package):
    assert sorted(package.__all__) == sorted(package._PLACES)


def test_importing_a_package_loads_no_torch():
    script = "import sys, agents, baselines, birthsim_env; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=True)
    assert done.stdout.strip() == "False"


def test_no_module_gives_a_name_twice():
    """A later constant or function of the same name would take the place of the first without a word."""
    root, twice = pathlib.Path(__file__).parents[2], []
    for package in ("birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_live"):
        for path in (root / package).rglob("*.py"):
            named: set[str] = set()
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                targets = node.targets if isinstance(node, ast.Assign) else [node] if hasattr(node, "name") else []
                targets += [node.target] if isinstance(node, ast.AnnAssign) else []
                names = [
                    part.id if isinstance(part, ast.Name) else part.name
                    for target in targets
                    for part in (target.elts if isinstance(target, ast.Tuple) else [target])
                    if isinstance(part, ast.Name) or hasattr(part, "name")
                ]
                twice += [f"{path.relative_to(root)}: {name}" for name in names if name in named]
                named.update(names)
    assert twice == []
