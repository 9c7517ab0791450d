"""The tutorials as notebooks: what the site offers, and what Colab and Binder would install."""

import os
import re
import subprocess

import pytest

from tests.console import ROOT

nbformat = pytest.importorskip("nbformat")
pytest.importorskip("jupytext")

ADDRESSES = (
    "../notebooks/{}.ipynb", "https://colab.research.google.com/github/someone/birthsim/blob/gh-pages/notebooks/{}.ipynb",
    "https://mybinder.org/v2/gh/someone/birthsim/gh-pages?labpath=notebooks%2F{}.ipynb",
)  # fmt: skip


@pytest.fixture(scope="module")
def notebooks(generated):
    return generated(".notebooks")


def read(notebooks, name):
    notebook = nbformat.reads(notebooks.notebook(name), 4)
    nbformat.validate(notebook)
    code = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    return code, "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")


def test_without_an_address_a_tutorial_is_a_file_that_installs_from_its_clone(notebooks, monkeypatch):
    monkeypatch.delenv("BIRTHSIM_REPOSITORY", raising=False)
    assert len(notebooks.NAMES) == 7
    for name in notebooks.NAMES:
        (first, *others), _ = read(notebooks, name)
        assert re.search(r'"install", "--quiet", "\.\./\.\.(\[agents\])?"\]', first)
        assert len(others) >= 3
        assert re.findall(r'href="([^"]+)"', notebooks.links(name)) == [ADDRESSES[0].format(name)]


def test_with_an_address_it_installs_from_there_and_colab_and_binder_open_it(notebooks, monkeypatch):
    monkeypatch.setenv("BIRTHSIM_REPOSITORY", "someone/birthsim")
    for name in notebooks.NAMES:
        (first, *_), words = read(notebooks, name)
        assert re.search(r'"install", "--quiet", "birthsim(\[agents\])? @ git\+https://github.com/someone/birthsim"\]', first)
        links = re.findall(r"\]\(([^)]+)\)", words)
        pages = [link.partition("#")[0] for link in links if link.startswith("https://github.com/someone/birthsim/blob/HEAD/")]
        assert len(pages) == len([link for link in links if "github.com/someone" in link or "://" not in link])
        assert [page for page in pages if not (ROOT / page.partition("/HEAD/")[2]).exists()] == []
        assert re.findall(r'href="([^"]+)"', notebooks.links(name)) == [address.format(name) for address in ADDRESSES]


def test_an_address_that_is_none_is_refused(notebooks, monkeypatch):
    monkeypatch.setenv("BIRTHSIM_REPOSITORY", "https://github.com/someone/birthsim")
    with pytest.raises(ValueError, match=r"BIRTHSIM_REPOSITORY = 'https://.*'; allowed: OWNER/NAME of a repository on GitHub"):
        notebooks.repository()


def test_binder_finds_beside_the_notebooks_what_it_installs_for_them(notebooks, monkeypatch, tmp_path):
    monkeypatch.delenv("BIRTHSIM_REPOSITORY", raising=False)
    notebooks.write(tmp_path / "nowhere")
    assert not (tmp_path / "nowhere" / "binder").exists(), "without a repository there is nothing that Binder could open"
    monkeypatch.setenv("BIRTHSIM_REPOSITORY", "someone/birthsim")
    notebooks.write(tmp_path)
    binder = tmp_path / "binder"
    assert len(list((tmp_path / "notebooks").glob("*.ipynb"))) == len(notebooks.NAMES)
    assert {path.name for path in binder.iterdir()} == {"constraints.txt", "postBuild", "requirements.txt", "runtime.txt"}
    assert os.access(binder / "postBuild", os.X_OK)
    wanted = (binder / "requirements.txt").read_text(encoding="utf-8")
    locked = re.search(r"^torch==(\S+)$", (ROOT / "constraints.txt").read_text(encoding="utf-8"), re.MULTILINE)[1]
    assert f"torch=={locked}+cpu" in wanted.splitlines()
    assert "birthsim[agents] @ git+https://github.com/someone/birthsim" in wanted.splitlines()
    assert "--constraint constraints.txt" in wanted.splitlines()
    first = "".join(read(notebooks, name)[0][0] for name in notebooks.NAMES)
    assert set(re.findall(r"birthsim\[(\w+)\] @", first)) == {"agents"}
    assert subprocess.run(["bash", "-n", binder / "postBuild"], check=False).returncode == 0
