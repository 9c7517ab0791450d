"""What the README says runs as it stands there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS, ids=[f"block {k}" for k in range(len(BLOCKS))])
def test_python_blocks_run(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(block, "README.md", "exec"), names)
    if "env" in names:
        env = names["env"]
        env.reset(seed=0)
        assert env.step(env.action_space.sample())[4]["time"] == pytest.approx(0.01)


def test_the_own_controller_is_the_example_file():
    shown = next(block for block in BLOCKS if "class PD" in block)
    without_docstring = ast.parse((ROOT / "examples" / "pd.py").read_text(encoding="utf-8"))
    without_docstring.body = without_docstring.body[1:]
    assert ast.dump(ast.parse(shown)) == ast.dump(without_docstring)


def test_linked_files_exist():
    links = re.findall(r"\]\(([^)]+)\)", TEXT) + re.findall(r"`((?:tests|examples|docs)/[^`: ]+)`", TEXT)
    assert len(links) >= 3
    assert [link for link in links if not (ROOT / link).exists()] == []
