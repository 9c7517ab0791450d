"""A figure of a result by its name, so that a page of the site can quote none that differs from it: the role ``figure``.

A name is a study and the way to the figure in ``results/STUDY.json``: ``worst:1/above``. In a table with columns and rows the
way ends with cells that only one row has, and a column: ``circle:lab/admittance-adaptive/settled_rms/median``; nothing between
two slashes is an empty cell. Environments are named without ``BirthSIM/``. ``circle:settings/episodes`` is what was asked for.
"""

from collections.abc import Sequence
from typing import Any

from birthsim_env.physics.rig.values import shown
from lab.studies.results import read_result


def figure(name: str) -> str:
    """The figure in three digits; ``ValueError`` for a name that leads to none or to several."""
    study, _, way = name.partition(":")
    content = read_result(study)
    if content is None:
        raise ValueError(f"figure = {shown(name)}; allowed: a study with results/{study}.json")
    try:
        found = _follow(content if way.startswith("settings/") else content["figures"], way.split("/"))
    except (LookupError, ValueError) as error:
        raise ValueError(f"figure = {shown(name)}: {error}") from None
    if isinstance(found, dict | list) or found is None:
        raise ValueError(f"figure = {shown(name)} is no number; allowed: the way on from there")
    return str(found) if isinstance(found, int | str) else f"{found:,.0f}" if abs(found) >= 1000 else f"{found:.3g}"


def _follow(found: Any, way: Sequence[str]) -> Any:
    for place, word in enumerate(way):
        if isinstance(found, dict) and "columns" in found and word not in found:
            return _cell(found, way[place:])
        if isinstance(found, dict) and word not in found:
            raise LookupError(f"{word!r}; allowed: {', '.join(found)}")
        found = found[word] if isinstance(found, dict) else found[int(word)]
    return found


def _cell(table: dict[str, Any], words: Sequence[str]) -> Any:
    *cells, column = words
    rows = [row for row in table["rows"] if set(cells) <= {str(cell).removeprefix("BirthSIM/") for cell in row}]
    if column not in table["columns"] or len(rows) != 1:
        raise LookupError(f"{len(rows)} rows with {cells}; allowed: one row, and of {', '.join(table['columns'])} one")
    return rows[0][table["columns"].index(column)]
