"""Registers something for the time of one test."""

from birthsim_env import registry


def registered(monkeypatch, made, about="of a test", **named):
    """As ``registry.register(kind="name", about=...)(made)`` until the test ends; it may take the place of another entry."""
    ((kind, name),) = named.items()
    monkeypatch.setitem(registry._ENTRIES[kind], name, registry.Entry(kind, name, made, about))
    monkeypatch.setitem(registry._WHERE, (kind, name), __name__)
    return made
