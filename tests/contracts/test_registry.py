"""The one registry: what registers itself is found, refused or left out, and who asks for it is told."""

import importlib
import sys
import warnings
from importlib.metadata import EntryPoint

import pytest

from birthsim_env import registry
from birthsim_env.parts.own_parts import from_file
from birthsim_env.registry import Entry, entries, entry, names, register, used


@pytest.fixture
def rooms(monkeypatch, tmp_path):
    """A registry of its own with one kind, "hand", whose room ``hands`` stands in ``tmp_path``."""
    monkeypatch.setattr(registry, "ROOMS", {"hand": ("hands",)})
    monkeypatch.setattr(registry, "_ENTRIES", {"hand": {}})
    monkeypatch.setattr(registry, "ROOT", tmp_path)
    monkeypatch.setattr(registry, "_BROKEN", {})
    monkeypatch.setattr(registry, "_ENTERED", set())
    monkeypatch.setattr(registry, "entry_points", lambda group: [])
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


def written(folder, **files):
    """The files of a room, each with what it registers; ``__init__.py`` is there."""
    folder.mkdir()
    (folder / "__init__.py").touch()
    for name, text in files.items():
        (folder / f"{name}.py").write_text(f"from birthsim_env.registry import register\n{text}\n")
    importlib.invalidate_caches()


def one(name, *more):
    return f"@register({', '.join((f'hand={name!r}', 'about=' + repr('Pulls.'), *more))})\nclass {name.title()}:\n    pass\n"


def test_a_file_in_a_room_is_found_and_lists_keep_their_order(rooms):
    written(rooms / "hands", later=one("later"), first=one("first", "order=1"), hidden=one("hidden", "listed=False"))
    assert names("hand") == ["first", "hidden", "later"]
    assert names("hand", listed=True) == ["first", "later"]
    assert names("hand", listed=False) == ["hidden"]
    found = entry("hand", "first")
    assert (found.kind, found.about, found.module) == ("hand", "Pulls.", "hands.first")
    assert found.made is sys.modules["hands.first"].First


def test_a_room_that_is_not_installed_is_empty(rooms):
    assert names("hand") == []
    with pytest.raises(ValueError, match=r"hand = 'push'; allowed: "):
        entry("hand", "push")


def test_a_package_of_another_owner_is_no_room_and_is_named(rooms, monkeypatch, tmp_path):
    monkeypatch.setattr(registry, "ROOT", tmp_path / "ours")
    written(rooms / "hands", broken="raise RuntimeError('imported')")
    assert names("hand") == []
    with pytest.raises(ValueError, match=r"hand = 'push'.*'hands' is left out") as caught:
        entry("hand", "push")
    assert str(tmp_path / "hands") in str(caught.value)


def test_a_room_that_fails_says_so_every_time(rooms):
    written(rooms / "hands", broken=f"raise RuntimeError('out of order')\n{one('push')}")
    for _ in range(2):
        with pytest.raises(RuntimeError, match="out of order"):
            names("hand")


def test_a_name_that_is_taken_is_refused(rooms):
    written(rooms / "hands", first=one("push"), second=one("push"))
    with pytest.raises(ValueError, match=r"hand = 'push'.*hands\.first.*hands\.second"):
        names("hand")


def test_a_file_cannot_register_a_name_twice_and_may_be_loaded_again(rooms):
    written(rooms / "hands", first=one("push"))
    made = entry("hand", "push").made
    importlib.reload(sys.modules["hands.first"])
    assert entry("hand", "push").made is not made
    with pytest.raises(ValueError, match="hand = 'pull'"):

        @register(hand="pull", about="Pulls.")
        @register(hand="pull", about="Pulls, again.")
        class Pull:
            pass

    with pytest.raises(ValueError, match="hand = 'pull'"):

        @register(hand="pull", about="Pulls.")
        class Other:
            pass


@pytest.mark.parametrize("named", [{}, {"hands": "push"}, {"hand": "push", "controller": "pid"}], ids=str)
def test_an_unknown_kind_is_refused(named):
    with pytest.raises(ValueError, match=r"allowed: one of .*controller"):
        register(about="", **named)


def test_needs_are_a_set():
    with pytest.raises(ValueError, match="needs = 'force sensor'; allowed: a set"):
        register(hand="push", about="Pushes.", needs="force sensor")


def test_a_file_that_is_given_by_its_path_registers_nothing(rooms):
    (rooms / "own.py").write_text(f"from birthsim_env.registry import register\n{one('push')}")
    assert from_file("hand", f"{rooms}/own.py:Push").__name__ == "Push"
    assert names("hand") == []


def test_what_is_near_is_asked_for(rooms):
    written(rooms / "hands", first=one("pushing"), second=one("pulling"))
    with pytest.raises(ValueError, match=r"hand = 'pushin'.*'pushing'"):
        entry("hand", "pushin")
    with pytest.raises(ValueError, match=r"hand = 'none'; allowed: pulling, pushing, or file\.csv"):
        entry("hand", "none", ", or file.csv")


def test_a_plugin_registers_and_one_that_fails_is_left_out_and_named(rooms, monkeypatch):
    written(rooms / "hands", first=one("push"))
    written(rooms / "theirs", good=one("tickle"), bad="import nothing_of_this_name")
    points = [EntryPoint(name, f"theirs.{name}", registry.PLUGINS) for name in ("good", "bad")]
    monkeypatch.setattr(registry, "entry_points", lambda group: points if group == registry.PLUGINS else [])
    with pytest.warns(UserWarning, match="plugin 'bad'.*nothing_of_this_name"):
        assert names("hand") == ["push", "tickle"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert entry("hand", "tickle").module == "theirs.good"
        with pytest.raises(ValueError, match=r"hand = 'x'.*'bad'.*nothing_of_this_name"):
            entry("hand", "x")


def test_a_deprecated_entry_warns_of_what_takes_its_place(rooms):
    written(rooms / "hands", first=one("push", "deprecated='tug'"), second=one("tug"))
    assert names("hand") == ["push", "tug"]
    with pytest.warns(DeprecationWarning, match="hand = 'push'.*tug") as caught:
        assert isinstance(entry("hand", "push"), Entry)
    assert caught[0].filename == __file__


def test_the_registry_remembers_which_entries_were_asked_for(rooms):
    written(rooms / "hands", first=one("push"), second=one("pull"))
    entry("hand", "push")
    with used() as outer:
        assert [found.name for found in entries("hand")] == ["pull", "push"]
        assert outer == set(), "a list is no use of what is in it"
        with used() as inner:
            entry("hand", "pull")
        entry("hand", "push")
        with pytest.raises(ValueError, match="hand"):
            entry("hand", "unknown")
    entry("hand", "pull")
    assert inner == {("hand", "pull")}
    assert outer == {("hand", "pull"), ("hand", "push")}
