"""Every registered controller and policy: what it is, what it needs, and what its name is short for."""

from baselines.named import compiled_names, resolved, uses_force, with_brackets
from birthsim_env.registry import Entry, entries


def controllers() -> str:
    """A table of controllers and one of policies."""
    compiled = compiled_names()
    rows = [
        (f"`{one.name}`", one.about, _short_for(one.name), _needs(one, one.name), "yes" if one.name in compiled else "no")
        for one in entries("controller")
    ]
    table = _table(("name", "what it is", "short for", "needs", "compiled"), rows)
    policies = [(f"`residual:{one.name}`", _needs(one, f"residual:{one.name}")) for one in entries("policy")]
    return f"{table}\n\n{_table(('policy that comes with the package', 'needs'), policies)}"


def _short_for(name: str) -> str:
    whole = with_brackets(*resolved(name))
    return "" if whole == name else f"`{whole}`"


def _needs(one: Entry, name: str) -> str:
    force = ["force sensor"] if uses_force(name) else []
    return ", ".join([*force, *sorted(one.needs - {"force sensor"})])


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ("---",) * len(head), *rows))
