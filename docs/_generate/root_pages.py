"""The pages of the repository's root, as pages of the site: their links lead to the site's pages. How to cite, for BibTeX."""

import re
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parent.parent.parent

PAGES = {
    "README.md": "readme",
    "CHANGELOG.md": "changelog",
    "CONTRIBUTING.md": "contributing",
    ".github/SECURITY.md": "security",
    "packaging/THIRD_PARTY.md": "third_party",
}
"""File -> its page in docs/project."""

CITATION = "CITATION.cff"


def root_page(name: str) -> str:
    """A page without its title, with links as seen from docs/project."""
    text = (ROOT / name).read_text(encoding="utf-8").partition("\n")[2]
    if name == "CHANGELOG.md":
        # What a changelog links to was there at the time: the page stays, a heading may not.
        text = re.sub(r"\]\((docs/[^)#]+)#[^)]*\)", r"](\1)", text)
    text = re.sub(r"\]\(docs/", "](../", text)
    for file, page in {**PAGES, CITATION: "citing"}.items():
        text = text.replace(f"]({file})", f"]({page}.md)").replace(f"](../{file})", f"]({page}.md)")
    return text


def bibtex() -> str:
    """Entries of the paper and of the software, from CITATION.cff."""
    cited: dict[str, Any] = yaml.safe_load((ROOT / CITATION).read_text(encoding="utf-8"))
    paper = cited["preferred-citation"]
    entries = [
        _entry(
            f"inproceedings{{{paper['authors'][0]['family-names'].lower()}{paper['year']}",
            author=_authors(paper),
            title=f"{{{paper['title']}}}",
            booktitle=paper["collection-title"],
            year=paper["year"],
            pages=f"{paper['start']}--{paper['end']}",
            doi=paper["doi"],
        ),
        _entry(
            f"software{{{cited['title'].lower()}",
            author=_authors(cited),
            title=f"{{{cited['title']}}}: {cited['abstract'].partition(',')[0].lower()}",
            version=cited["version"],
            year=str(cited.get("date-released", ""))[:4],
            url=cited.get("repository-code", ""),
        ),
    ]
    return "```bibtex\n" + "\n\n".join(entries) + "\n```"


def _entry(head: str, **fields: object) -> str:
    """An entry of the fields that are known."""
    return "\n".join([f"@{head},", *(f"  {name} = {{{value}}}," for name, value in fields.items() if value), "}"])


def _authors(cited: dict[str, Any]) -> str:
    people = (
        f"{one['family-names']}, {one['given-names']}" if "family-names" in one else f"{{{one['name']}}}"
        for one in cited["authors"]
    )
    return " and ".join(people)
