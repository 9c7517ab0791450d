"""Tables of ``birthsim drive``: kinds of faults, what can be provoked, and drivers."""

from birthsim_drive.provoked import KINDS as PROVOKED
from birthsim_drive.safety.faults import KINDS, WATCHED


def faults() -> str:
    """A row for each kind of fault."""
    rows = [f"| `{name}` | {kind.about} | {_may(name)} |" for name, kind in KINDS.items()]
    return "\n".join(["| fault | when | may be |", "|---|---|---|", *rows])


def _may(name: str) -> str:
    if name in WATCHED:
        return "`stop()` of a new driver"
    return "`close`, `vent`, `hold`" if KINDS[name].may_hold else "`close`, `vent`"


def provoked() -> str:
    """A row for each kind that ``--provoke`` takes."""
    return "\n".join(
        ["| `--provoke` | what happens |", "|---|---|", *(f"| `{name}` | {about} |" for name, about in PROVOKED.items())]
    )
