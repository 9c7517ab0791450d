"""Files that hold tables: a row for each registered reader."""

from birthsim_env.registry import entries


def readers() -> str:
    """The table."""
    rows = [f"| `{one.name}` | {one.about} | {', '.join(sorted(one.needs))} |" for one in entries("reader")]
    return "\n".join(["| ending, in any case | what is read | needs |", "|---|---|---|", *rows])
