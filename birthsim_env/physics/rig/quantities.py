"""Dataclass fields that know their unit, their basis, their limits and their range, and parts made of such fields."""

import dataclasses
import math
from typing import Any

from birthsim_env.physics.rig.values import is_within, limits, make_plain, shown


def quantity(
    default: Any,
    unit: str,
    basis: str,
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    most: float = math.inf,
    randomized: tuple[float, float] | None = None,
    choices: tuple[str, ...] = (),
    option: bool = False,
    worth: tuple[float, float] | None = None,
) -> Any:
    """A dataclass field that knows its unit, its basis, its limits and the range that domain randomisation draws from.

    ``Parameters.to_dict`` names an ``option`` only where it differs from its default: results that are stored by what it
    returns keep their place when options are added. ``worth`` is the range that an option is worth being drawn from: it is
    drawn only where ``randomize`` or the owner's ``ranges`` name it.
    """
    metadata = {
        "unit": unit, "basis": basis, "above": above, "least": least, "most": most, "randomized": randomized,
        "choices": choices, "option": option, "worth": worth,
    }  # fmt: skip
    return dataclasses.field(default=default, metadata=metadata)


def _check_field(owner: str, field: dataclasses.Field[Any], value: Any) -> None:
    m = field.metadata
    bounds = m["above"], m["least"], m["most"]
    if m["choices"]:
        valid, allowed = isinstance(value, str) and value in m["choices"], f"one of {', '.join(map(repr, m['choices']))}"
    else:
        valid = is_within(value, *bounds)
        allowed = f"a finite number{limits(*bounds)} ({m['unit']})"
    if not valid:
        raise ValueError(f"{owner}.{field.name} = {shown(value)} is impossible; allowed: {allowed}")


class Part:
    """A group of quantities: checks every value by name, and lists its fields in the docstring of each subclass."""

    def __init_subclass__(cls) -> None:
        """Append the fields with unit, basis and range to the docstring."""
        lines = [cls.__doc__ or "", "", "Fields (unit; basis; range of domain randomisation):", ""]
        for name, field in vars(cls).items():
            if isinstance(field, dataclasses.Field):
                m = field.metadata
                drawn = f"; {m['randomized'][0]:g} to {m['randomized'][1]:g}" if m["randomized"] else ""
                drawn += f"; worth drawing {m['worth'][0]:g} to {m['worth'][1]:g}" if m["worth"] else ""
                lines.append(f"- ``{name}`` = {field.default!r} ({m['unit']}; {m['basis']}{drawn})")
        cls.__doc__ = "\n".join(lines)

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            _check_field(type(self).__name__, field, getattr(self, field.name))
        make_plain(self)
        self._check_together()

    def to_dict(self, options: bool) -> dict[str, Any]:
        """All values by name; without ``options`` an option only where it differs from its default."""
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        values = {field.name: getattr(self, field.name) for field in fields}
        return {f.name: values[f.name] for f in fields if options or not f.metadata["option"] or values[f.name] != f.default}

    def _check_together(self) -> None:
        """Refuse values that are possible one by one but not together."""
