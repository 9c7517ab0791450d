"""Pages as GitHub renders them: by the rules of CommonMark, nothing raw remains, and README and paper say what was meant."""

import re
import subprocess

import pytest
from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin
from mdit_py_plugins.front_matter import front_matter_plugin

from tests.console import ROOT

LISTED = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
PAGES = [ROOT / name for name in LISTED]
READ_WHOLE = [ROOT / "README.md", ROOT / "lab" / "paper" / "paper.md"]
"""Pages in plain CommonMark, without MyST's roles and directives."""

READER = MarkdownIt("commonmark").enable(["table", "strikethrough"]).use(front_matter_plugin).use(dollarmath_plugin)
COMMENTS = re.compile(r"(<!--(?:(?!-->).)*-->\s*)+", re.DOTALL)
FOLDED = re.compile(r"<details>\s*<summary>[^<>]*</summary>\s*|</details>\s*")
"""HTML that readers unfold, on GitHub and on the site."""
RAW = ("`", "](", "**", "<!--", "-->", "|---")
ROLE = re.compile(r"\{\w+\}`")
"""MyST's, which only the site knows: pages below docs are its sources."""


def pieces(text):
    """(kind, text) of everything that CommonMark finds: words, code, and HTML that it leaves alone."""
    for token in READER.parse(text):
        for one in token.children or [token]:
            if one.content:
                yield one.type, one.content


def problems(text):
    """What readers would see raw, or not at all."""
    found = []
    for kind, said in pieces(text):
        if kind in ("html_block", "html_inline") and not (COMMENTS.fullmatch(said) or FOLDED.fullmatch(said)):
            found.append(f"HTML: {said[:80]}")
        if kind == "text":
            found += [f"{mark} in: {said[:80]}" for mark in RAW if mark in said]
    found += [line[:80] for line in text.splitlines() if re.match(r"\s*<!--.*-->\s*\S", line)]
    return found


def shown(text):
    """The words of a page as CommonMark shows them."""
    blocks = []
    for token in READER.parse(text):
        inside = [" " if one.type.endswith("break") else one.content for one in token.children or []]
        blocks.append("" if token.type in ("html_block", "front_matter") else "".join(inside) or token.content)
    return words(" ".join(blocks))


def words(text):
    return re.findall(r"[\w.,;:%/+-]+", text)


def meant(text):
    """The words of a page in plain CommonMark, found without a parser: marks are taken off line by line."""
    text = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)
    text = re.sub(r"^<!--.*?-->$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^```.*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"!?\[([^][]*)\]\([^()\s]*\)", r"\1", text)
    text = re.sub(r"^\|[-|]+\|$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^(#+|-|\d+\.) ", "", text, flags=re.MULTILINE)
    return words(re.sub(r"\*\*|(?<!\w)\*(?=\w)|(?<=\w)\*(?!\w)|`", "", text).replace("|", " "))


@pytest.mark.parametrize("page", PAGES, ids=LISTED)
def test_nothing_raw_remains(page):
    assert problems(page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("page", READ_WHOLE, ids=lambda page: page.name)
def test_a_page_says_what_was_meant(page):
    text = page.read_text(encoding="utf-8")
    assert shown(text) == meant(text)
    assert not ROLE.search(text)


BROKEN = {
    "a comment at the beginning of a line": "A core takes\n<!-- a:b -->3<!-- end --> of `these` ([how](a.md)).",
    "a comment within a line and at its beginning": "It takes <!-- a:b -->3<!-- end -->\n<!-- a:c -->4<!-- end --> of `those`.",
    "text right after a block": "<!-- results of a -->\n**bold** text\n\n<div>and `this`\n</div>",
    "a link over a blank line": "see [the\n\npage](a.md)",
    "an open mark": "this is **not closed, and `neither is this",
}


@pytest.mark.parametrize("what", BROKEN)
def test_what_breaks_is_found(what):
    assert problems(BROKEN[what]) != [] or shown(BROKEN[what]) != meant(BROKEN[what])
