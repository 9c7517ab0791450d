"""The pages of the repository's root, as pages of the site: their links lead to the site's pages."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent

PAGES = {
    "README.md": "readme",
    "CHANGELOG.md": "changelog",
    "CONTRIBUTING.md": "contributing",
    ".github/SECURITY.md": "security",
    "packaging/THIRD_PARTY.md": "third_party",
}
"""File -> its page in docs/project."""


def root_page(name: str) -> str:
    """A page without its title, with links as seen from docs/project."""
    text = (ROOT / name).read_text(encoding="utf-8").partition("\n")[2]
    if name == "CHANGELOG.md":
        # What a changelog links to was there at the time: the page stays, a heading may not.
        text = re.sub(r"\]\((docs/[^)#]+)#[^)]*\)", r"](\1)", text)
    text = re.sub(r"\]\(docs/", "](../", text)
    for file, page in PAGES.items():
        text = text.replace(f"]({file})", f"]({page}.md)").replace(f"](../{file})", f"]({page}.md)")
    return text
