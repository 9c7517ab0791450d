"""Headings of columns: a name in any case, which may be one of several for the same thing, and a unit beside it."""

import re

from birthsim_env.tables.units import unit_of

_CHAMBERS = ("P1", "N1", "P2", "N2", "P", "N")
"""The last two are those of a rig with one cylinder."""

_OPENINGS = ("openings", "opening", "valve", "valves", "valve_opening", "valve_openings")
_PRESSURES = ("pressures", "pressure", "p", "chamber_pressure")

CONCEPTS: dict[str, tuple[str, tuple[str, ...]]] = {
    "time": ("s", ("t", "times", "log_time", "timestamp", "elapsed", "elapsed_time", "x_value")),
    **{f"position_{a}": ("m", (a, f"pos_{a}", f"{a}_position", f"{a}_pos")) for a in "xy"},
    **{f"force_{a}": ("N", (f"F{a}", f"{a}_force", f"hand_force_{a}", f"user_force_{a}")) for a in "xy"},
    "stiffness": ("N/m", ()),
    "position": ("m", ("pos",)),
    "force": ("N", ()),
    "opening": ("1", ()),
    **{
        f"{words[0]}_{chamber}": (unit, tuple(name for word in words for name in (f"{word}_{chamber}", f"{chamber}_{word}")))
        for words, unit in ((_OPENINGS, "1"), (_PRESSURES, "Pa"))
        for chamber in _CHAMBERS
    },
}
"""What a column can be -> its SI unit, and other names that say the same."""


def key(name: str) -> str:
    """Letters and digits of a name in one case: ``force_x``, ``Force X``, ``forceX`` and ``force.x`` are the same."""
    return "".join(letter for letter in name.casefold() if letter.isalnum()) or name.strip()


_CONCEPT = {key(name): concept for concept, (_, names) in CONCEPTS.items() for name in (concept, *names)}


def concept(name: str) -> str:
    """What a column of this name is: one of ``CONCEPTS``, else its ``key``."""
    return _CONCEPT.get(key(name), key(name))


def is_known(name: str) -> bool:
    """Whether a name is one of ``CONCEPTS`` or another name of one."""
    return key(name) in _CONCEPT


def name_and_unit(heading: str) -> tuple[str, str]:
    """A heading as a name and the unit that it states, or "": ``Fx (N)``, ``Fx [N]``, ``Fx / N``, ``Fx_N``, ``Fx, N``.

    A unit without brackets counts where it suits a known name, ``Fx_m`` is in no metres. Of a name that is not known, letters
    at its end count where they can hardly mean anything else, as in ``Fz_kN``; they stay in the name.
    """
    text = " ".join(heading.strip().strip("\"'").split())
    bracketed = re.fullmatch(r"(.*?)[\s_]*(?:\(([^()]*)\)|\[([^\[\]]*)\]|\{([^{}]*)\})", text)
    if bracketed is not None and bracketed[1]:
        said = next(unit for unit in bracketed.groups()[1:] if unit is not None).strip()
        # pressures[P1] is the name of a chamber's pressure; openings_P1 [%] has a unit.
        return (text, "") if key(said).isalnum() and unit_of(said) is None and is_known(text) else (bracketed[1], said)
    apart = re.fullmatch(r"(.+?)\s*(?:[/,_. ]\s*([^/,_. %]+(?:/m+)?)|(%))", text)
    word = "" if apart is None else apart[2] or apart[3]
    unit = unit_of(word)
    if apart is None or unit is None:
        return text, ""
    if is_known(apart[1]) and CONCEPTS[concept(apart[1])][0] == unit[0]:
        return apart[1], word
    return text, word if len(word) > 1 and not is_known(apart[1]) else ""


def is_units(cells: list[str], below: bool = False) -> bool:
    """Whether a line of cells is a row of units: most of its words are known ones, and none is a name. ``below`` a heading of
    known names one of them is enough: the others are units that are not known, which must not be taken for SI."""
    words = [word for cell in cells if (word := _bare(cell)) not in ("", "-")]
    known = [unit_of(word) is not None for word in words]
    named = [is_known(word) and not known[k] for k, word in enumerate(words)]
    return sum(known) > (0 if below else len(words) / 2) and not any(named)


def _bare(cell: str) -> str:
    """What a cell of a row of units says, without brackets; nothing where it says that this is a row of units."""
    cell = cell.strip()
    cell = cell[1:-1].strip() if len(cell) > 1 and cell[0] + cell[-1] in ("()", "[]", "{}") else cell
    return "" if key(cell) in ("unit", "units", "na", "none") else cell


def units_of(cells: list[str]) -> list[str]:
    """The units of a row of units, without their brackets."""
    return [_bare(cell) for cell in cells]


_GIVERS = frozenset(
    ("hand", "user", "operator", "ext", "load", "push", "pull", "grip", "tension", "effort", "interaction", "ati")
)
"""Words that before an axis hardly mean anything but a force."""


def is_like_force(name: str, unit: str) -> bool:
    """Whether a column looks like a force, by its name or unit."""
    found = unit_of(unit)
    if found is not None and found[0] == "N":
        return True
    words = [word for word in re.split(r"[^a-zA-Z0-9]+|(?<=[a-z])(?=[A-Z])", name) if word]
    folded = [word.casefold() for word in words]
    axes = len(words) > 1 and re.fullmatch(r"[a-z]?[xyz]|[0-2]", folded[-1])
    return bool(
        re.search(r"force|frc|kraft|fuerza|wrench|loadcell|ftsensor|newton|lbf|kgf", key(name))
        or re.fullmatch(r"(?i)f([ _.]?(hand|user|ext|meas|load)|[ _.]?[xyzabt12]([ _.].*)?)?", name)
        or any(re.fullmatch(r"f[ehu]?[txyz][0-9]?", word) for word in folded)
        or folded == ["hand"]
        or (axes and (folded[0] in ("f", "fe", "fh", "fu") or folded[-2] in _GIVERS))
        or (len(words) > 1 and words[-1] == "N")
    )
