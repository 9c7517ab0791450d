"""Words of docs/ outside tables: fails above the budget, and prints the total with the largest pages (`make prose`)."""

import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent.parent
BUDGET = 22_000
"""Words of all pages together, code included; lines that begin with | are tables."""


def words(text: str) -> int:
    """Words of one page outside its tables."""
    return sum(len(line.split()) for line in text.splitlines() if not line.lstrip().startswith("|"))


counts = {page.relative_to(DOCS): words(page.read_text(encoding="utf-8")) for page in DOCS.rglob("*.md")}
total = sum(counts.values())
print(f"docs: {total:,} words outside tables; budget {BUDGET:,}")
if total > BUDGET:
    largest = sorted(counts, key=lambda page: -counts[page])[:10]
    sys.exit("too long; the largest pages: " + ", ".join(f"{page} {counts[page]:,}" for page in largest))
