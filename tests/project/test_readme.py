"""What pages say runs as it stands there; every link, file and target of make that they name exists."""

import ast
import re

import pytest

from tests.build.targets import imported, need_linker
from tests.console import ROOT

PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]


TEXTS = {page: page.read_text(encoding="utf-8") for page in PAGES}
BLOCKS = {
    f"{page.relative_to(ROOT)} {k}": block
    for page, text in TEXTS.items()
    for k, block in enumerate(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
}


TRAINS = {name for name, block in BLOCKS.items() if ".learn(" in block}
"""Blocks that take more than a few seconds."""


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in TRAINS else ()) for name in BLOCKS])
def test_python_blocks_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(ROOT / "examples")
    if "fmpy" in BLOCKS[name]:
        need_linker()
        imported("fmpy")
    names = {}
    exec(compile(BLOCKS[name], name, "exec"), names)
    if "env" in names:
        env = names["env"]
        env.reset(seed=0)
        assert env.step(env.action_space.sample())[4]["time"] == pytest.approx(0.01)


def test_the_own_controller_is_the_example_file():
    (shown,) = (block for block in BLOCKS.values() if "class PD" in block)
    without_docstring = ast.parse((ROOT / "examples" / "pd.py").read_text(encoding="utf-8"))
    without_docstring.body = without_docstring.body[1:]
    assert ast.dump(ast.parse(shown)) == ast.dump(without_docstring)


def readers(page):
    """The folders from which a page's links lead: for a table, those of the pages that include it."""
    if page.parent.name != "data":
        return {page.parent}
    included = re.compile(rf"\{{include\}} [./]*data/{page.name}$", re.MULTILINE)
    return {other.parent for other, text in TEXTS.items() if included.search(text)}


def test_linked_files_exist():
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for page, text in TEXTS.items():
        links = [link for link in re.findall(r"\]\(([^)#]+)[^)]*\)", text) if "://" not in link]
        assert [link for link in links if not all((folder / link).exists() for folder in readers(page))] == [], page
        named = re.findall(r"`((?:tests|examples|docs|agents|baselines|birthsim_(?:build|env|live))/[\w/.]+)`", text)
        assert page.stem == "CHANGELOG" or [name for name in named if not (ROOT / name).exists()] == [], page
        assert {name for names in re.findall(r"`make ([a-z -]+)`", text) for name in names.split()} <= targets, page
