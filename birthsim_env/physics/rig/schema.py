"""Kinds of values that a tree of plain data may hold, such as what a JSON file says.

A schema is one of: ``str``, ``bool``, ``int``, ``dict``, ``list``, ``None``; ``float`` for any number; ``object`` for all; a
``range`` for the whole numbers in it; ``{"name": schema, "other?": schema}`` for an object that has at least these names, of
which those with "?" may be missing; ``Each`` and ``Listed``; a tuple of schemas without parts, of which one has to fit.
"""

from typing import Any, NamedTuple

from birthsim_env.physics.rig.values import shown

_WORDS: dict[Any, str] = {
    str: "text", bool: "true or false", int: "a whole number", float: "a number", dict: "an object", list: "a list",
    None: "null", object: "anything",
}  # fmt: skip


class Each(NamedTuple):
    """A schema: an object of any names, each value of which fits ``inner``."""

    inner: Any


class Listed(NamedTuple):
    """A schema: a list of at least ``least`` entries, each of which fits ``inner``."""

    inner: Any
    least: int = 0


def fault(value: Any, schema: Any, place: str = "content") -> str:
    """What of a value does not fit its schema, and what is allowed there; "" where all does."""
    if not _fits(value, schema):
        return f"{place} = {shown(value)}; allowed: {_words(schema)}"
    if isinstance(schema, dict):
        if missing := next((name for name in schema if not name.endswith("?") and name not in value), ""):
            return f"{place} lacks {missing!r}; allowed: {_words(schema)}"
        known = {name.removesuffix("?"): inner for name, inner in schema.items()}
        parts = [(f"{place}.{name}", value[name], inner) for name, inner in known.items() if name in value]
    elif isinstance(schema, Each):
        parts = [(f"{place}.{shown(name)}", one, schema.inner) for name, one in value.items()]
    elif isinstance(schema, Listed):
        parts = [(f"{place}[{k}]", one, schema.inner) for k, one in enumerate(value)]
    else:
        return ""
    return next(filter(None, (fault(one, inner, where) for where, one, inner in parts)), "")


def _fits(value: Any, schema: Any) -> bool:
    """Whether a value is of the kind of a schema; what is in it is not looked at."""
    if isinstance(schema, (dict, Each)):
        return isinstance(value, dict)
    if isinstance(schema, Listed):
        return isinstance(value, list) and len(value) >= schema.least
    if isinstance(schema, tuple):
        return any(_fits(value, one) for one in schema)
    if schema is None or isinstance(value, bool):
        return value is schema or schema in (bool, object)
    if isinstance(schema, range):
        return isinstance(value, int) and value in schema
    return isinstance(value, (int, float) if schema is float else schema)


def _words(schema: Any) -> str:
    """A schema in words."""
    if isinstance(schema, dict):
        return f"an object with {', '.join(name for name in schema if not name.endswith('?'))}"
    if isinstance(schema, Each):
        return _WORDS[dict]
    if isinstance(schema, Listed):
        return f"a list of at least {schema.least}" if schema.least else _WORDS[list]
    if isinstance(schema, tuple):
        return " or ".join(map(_words, schema))
    return f"{schema[0]} to {schema[-1]}" if isinstance(schema, range) else _WORDS[schema]
