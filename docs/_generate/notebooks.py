"""The tutorials as notebooks: files to download, and where Colab and Binder open them."""

import os
import re
from pathlib import Path
from urllib.parse import quote

import jupytext

TUTORIALS = Path(__file__).resolve().parent.parent / "tutorials"
NAMES = sorted(path.stem for path in TUTORIALS.glob("*.md") if "{code-cell}" in path.read_text(encoding="utf-8"))
BRANCH = "gh-pages"
"""Of the repository, where the site is published: Colab opens notebooks of a repository only."""


def repository() -> str:
    """OWNER/NAME of the repository on GitHub, from the variable BIRTHSIM_REPOSITORY; an empty string where it has none."""
    name = os.environ.get("BIRTHSIM_REPOSITORY", "")
    if name and not re.fullmatch(r"[\w.-]+/[\w.-]+", name):
        raise ValueError(f"BIRTHSIM_REPOSITORY = {name!r}; allowed: OWNER/NAME of a repository on GitHub, or not set")
    return name


def notebook(name: str) -> str:
    """A tutorial as .ipynb. With a repository its first cell installs BirthSIM from there, and links lead there."""
    text = (TUTORIALS / f"{name}.md").read_text(encoding="utf-8")
    if where := repository():
        text = re.sub(r'"\.\./\.\.((?:\[\w+\])?)"', rf'"birthsim\1 @ git+https://github.com/{where}"', text)
        text = re.sub(r"\]\(\.\./", f"](https://github.com/{where}/blob/HEAD/docs/", text)
        text = re.sub(r"\]\((?=\w+\.md)", f"](https://github.com/{where}/blob/HEAD/docs/tutorials/", text)
    return jupytext.writes(jupytext.reads(text, fmt="md:myst"), fmt="ipynb")


def write(folder: Path) -> None:
    """Write all of them into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        (folder / f"{name}.ipynb").write_text(notebook(name), encoding="utf-8")


def links(name: str) -> str:
    """HTML for the page of a tutorial."""
    found = {"Download this notebook": f"../notebooks/{name}.ipynb"}
    if where := repository():
        found["Open in Colab"] = f"https://colab.research.google.com/github/{where}/blob/{BRANCH}/notebooks/{name}.ipynb"
        found["Open in Binder"] = (
            f"https://mybinder.org/v2/gh/{where}/HEAD?labpath={quote(f'docs/tutorials/{name}.ipynb', safe='')}"
        )
    return f'<p class="notebook">{" · ".join(f"""<a href="{address}">{words}</a>""" for words, address in found.items())}</p>\n'
