"""The tutorials as notebooks: files to download, and where Colab and Binder open them."""

import os
import re
import shutil
from pathlib import Path
from urllib.parse import quote

import jupytext
from nbformat.v4 import new_code_cell

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = ROOT / "docs" / "tutorials"
NAMES = sorted(path.stem for path in TUTORIALS.glob("*.md") if "{code-cell}" in path.read_text(encoding="utf-8"))
BRANCH = "gh-pages"
"""Of the repository, where the site is published: Colab opens notebooks of a repository only, and Binder reads ``binder/`` at
the root of what it opens, which the clone has in ``packaging/``."""

INSTALLS = """# Installs BirthSIM where it is absent.
import importlib.util
import subprocess
import sys

if importlib.util.find_spec("birthsim_env") is None:
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "{}"], check=True)"""


def repository() -> str:
    """OWNER/NAME of the repository on GitHub, from the variable BIRTHSIM_REPOSITORY; an empty string where it has none."""
    name = os.environ.get("BIRTHSIM_REPOSITORY", "")
    if name and not re.fullmatch(r"[\w.-]+/[\w.-]+", name):
        raise ValueError(f"BIRTHSIM_REPOSITORY = {name!r}; allowed: OWNER/NAME of a repository on GitHub, or not set")
    return name


def notebook(name: str) -> str:
    """A tutorial as .ipynb. Its first cell installs BirthSIM where it is absent: with a repository from there, and links lead
    there, else from the clone around it."""
    text = (TUTORIALS / f"{name}.md").read_text(encoding="utf-8")
    extra = "[agents]" if re.search("^(from|import) agents", text, re.MULTILINE) else ""
    source = f"../..{extra}"
    if where := repository():
        source = f"birthsim{extra} @ git+https://github.com/{where}"
        text = re.sub(r"\]\(\.\./", f"](https://github.com/{where}/blob/HEAD/docs/", text)
        text = re.sub(r"\]\((?=\w+\.md)", f"](https://github.com/{where}/blob/HEAD/docs/tutorials/", text)
    document = jupytext.reads(text, fmt="md:myst")
    first = next(k for k, cell in enumerate(document.cells) if cell.cell_type == "code")
    document.cells.insert(first, new_code_cell(INSTALLS.format(source)))
    return jupytext.writes(document, fmt="ipynb")


def write(site: Path) -> None:
    """Write all of them below a site, and with a repository what Binder installs for them."""
    folder = site / "notebooks"
    folder.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        (folder / f"{name}.ipynb").write_text(notebook(name), encoding="utf-8")
    if where := repository():
        binder = site / "binder"
        shutil.copytree(ROOT / "packaging" / "binder", binder, dirs_exist_ok=True)
        shutil.copy(ROOT / "constraints.txt", binder)
        wanted = binder / "requirements.txt"
        wanted.write_text(wanted.read_text(encoding="utf-8").replace("OWNER/NAME", where), encoding="utf-8")


def links(name: str) -> str:
    """HTML for the page of a tutorial."""
    found = {"Download this notebook": f"../notebooks/{name}.ipynb"}
    if where := repository():
        found["Open in Colab"] = f"https://colab.research.google.com/github/{where}/blob/{BRANCH}/notebooks/{name}.ipynb"
        found["Open in Binder"] = (
            f"https://mybinder.org/v2/gh/{where}/{BRANCH}?labpath={quote(f'notebooks/{name}.ipynb', safe='')}"
        )
    saved = {address: " download" for address in found.values() if "://" not in address}
    links = (f'<a href="{address}"{saved.get(address, "")}>{words}</a>' for words, address in found.items())
    return f'<p class="notebook">{" · ".join(links)}</p>\n'
