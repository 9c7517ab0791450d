"""The glossary for pages that use its words: word -> meaning, as a script of the site (docs/_static/glossary.js shows it)."""

import json
import re
from pathlib import Path

GLOSSARY = Path(__file__).resolve().parent.parent / "reference" / "glossary.md"


def meanings() -> dict[str, str]:
    """Each word of the glossary's first table with its meaning, without marks of Markdown."""
    first = GLOSSARY.read_text(encoding="utf-8").partition("\n## ")[0]
    rows = [line.split("|") for line in first.splitlines() if line.startswith("| ")][1:]
    plain = {words: re.sub(r"\[([^]]*)\]\([^)]*\)|[*`$]", r"\1", meaning).strip() for _, words, meaning, *_ in rows}
    return {word: meaning for words, meaning in plain.items() for word in words.strip().split(", ")}


def script() -> str:
    """JavaScript that tells the pages."""
    return f"const GLOSSARY = {json.dumps(meanings(), ensure_ascii=False)};\n"
