"""Registers something for the time of one test."""

from importlib.metadata import EntryPoint

from birthsim_env import registry


def with_plugins(monkeypatch, *modules, kinds=("controller", "policy")):
    """As if distributions were installed whose entry points name these modules, and no others; they register ``kinds``."""
    for kind in kinds:
        registry.names(kind)  # rooms are entered once, and what they register stays
    points = [EntryPoint(module, module, registry.PLUGINS) for module in modules]
    monkeypatch.setattr(registry, "_ENTRIES", {kind: dict(found) for kind, found in registry._ENTRIES.items()})
    monkeypatch.setattr(registry, "_ENTERED", set())
    monkeypatch.setattr(registry, "_BROKEN", {})
    monkeypatch.setattr(registry, "entry_points", lambda group: points if group == registry.PLUGINS else [])


def registered(monkeypatch, made, about="of a test", needs=(), **named):
    """As ``registry.register(kind="name", about=...)(made)`` until the test ends; it may take the place of another entry."""
    ((kind, name),) = named.items()
    monkeypatch.setitem(
        registry._ENTRIES[kind], name, registry.Entry(kind, name, made, about, frozenset(needs), module=__name__)
    )
    return made
