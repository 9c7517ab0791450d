"""Every registered controller and policy: what it is, what it needs, and what its name is short for."""

from baselines.named import compiled_names, learns_mass, resolved, uses_force, with_brackets
from birthsim_env.registry import Entry, entries


def controllers() -> str:
    """A table of controllers and one of policies."""
    compiled = compiled_names()
    rows = [
        (
            f"`{one.name}`",
            one.about,
            _short_for(one.name),
            _needs(one, one.name),
            "yes" if learns_mass(one.name) else "no",
            "yes" if one.name in compiled else "no",
        )
        for one in entries("controller")
    ]
    table = _table(("name", "what it is", "short for", "needs", "learns the mass", "compiled"), rows)
    policies = [
        (f"`{name}`", _needs(one, name), "yes" if learns_mass(name) else "no")
        for one in entries("policy")
        for name in [f"residual:{one.name}"]
    ]
    return f"{table}\n\n{_table(('policy that comes with the package', 'needs', 'learns the mass'), policies)}"


def _short_for(name: str) -> str:
    whole = with_brackets(*resolved(name))
    return "" if whole == name else f"`{whole}`"


def _needs(one: Entry, name: str) -> str:
    force = ["force sensor"] if uses_force(name) else []
    return ", ".join([*force, *sorted(one.needs - {"force sensor"})])


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ("---",) * len(head), *rows))
