"""A result is stale where something changed that its study calls, or an entry that it asked the registry for."""

from types import SimpleNamespace

import pytest

from baselines.work import calls, definitions
from birthsim_env.physics.compiled import sources
from lab.engine.results import changed, provenance
from tests.studies.scratch import TREE, written

MEASURE = SimpleNamespace(__module__="lab.studies.one", __qualname__="measure")
USED = {"controller=pid": "baselines.pid"}


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """``TREE`` in place of the project; to be called with a file, a text in it and what takes its place."""
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    written(tmp_path, TREE)
    cached = [one for module in (calls, definitions) for one in vars(module).values() if hasattr(one, "cache_clear")]

    def edit(file, old="", new=""):
        path = tmp_path / file
        text = path.read_text() if path.exists() else ""
        assert old in text
        path.write_text(text.replace(old, new, 1) if old else text + new)
        for one in cached:
            one.cache_clear()

    for one in cached:
        one.cache_clear()
    yield edit
    for one in cached:
        one.cache_clear()


def result(functions=(MEASURE,), used=USED):
    return provenance({"dirty": []}, functions, used)


ADRC = '\nfrom birthsim_env.registry import register\n\n@register(controller="adrc", about="")\nclass ADRC:\n    pass\n'


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("baselines/adrc.py", "", ADRC),
        ("baselines/pid.py", "", ADRC),
        ("baselines/pid.py", "0.0", "1.0"),
        ("baselines/pid.py", '"gain": 1.0', '"gain": 2.0'),
        ("baselines/middle.py", "through(None)", "None"),
        ("baselines/middle.py", "", "def more():\n    return LIMIT\n"),
        ("birthsim_env/plant.py", "advance(None, rig, 1)", "advance(None, rig, 2)"),
        ("birthsim_env/plant.py", "# of the rig", "# of a rig"),
        ("birthsim_env/plant.py", "A step.", "One step."),
        ("birthsim_env/logs.py", "None", "1"),
        ("birthsim_env/generated.py", "3.0", "4.0"),
        ("birthsim_env/env.py", "1.0", "2.0"),
        ("birthsim_env/registry.py", "None", "1"),
        ("lab/studies/one.py", "one.md", "two.md"),
    ],
    ids=str,
)
def test_an_edit_of_what_is_not_called_leaves_a_result_fresh(tree, file, old, new):
    before = result()
    tree(file, old, new)
    assert changed(before, [MEASURE]) == []


@pytest.mark.parametrize(
    ("file", "old", "new", "named"),
    [
        ("birthsim_env/plant.py", "* limit", "+ limit", "birthsim_env/plant.py:advance"),
        ("birthsim_env/plant.py", "njit(function)", "function", "birthsim_env/plant.py:kernel"),
        ("birthsim_env/plant.py", "rig: 4", "rig: 5", "birthsim_env/plant.py:_length"),
        ("birthsim_env/plant.py", '"a": 1.0', '"a": 2.0', "birthsim_env/plant.py:TABLE"),
        ("birthsim_env/generated.py", "return value", "return -value", "birthsim_env/generated.py:inner"),
        ("birthsim_env/generated.py", "1.0", "4.0", "birthsim_env/generated.py:outer"),
        ("birthsim_env/generated.py", "2.0", "4.0", "birthsim_env/generated.py:by_name"),
        ("birthsim_env/late.py", "return value", "return -value", "birthsim_env/late.py:finish"),
        ("birthsim_env/rig.py", "3.0", "4.0", "birthsim_env/rig.py:MASS"),
        ("birthsim_env/rig.py", "length: float = 1.0", "length: float = 2.0", "birthsim_env/rig.py:Rig"),
        ("birthsim_env/scaling.py", "by=2.0", "by=3.0", "birthsim_env/scaling.py:scaled"),
        ("baselines/middle.py", "+= 1", "+= 2", "baselines/middle.py:LIMIT"),
        ("baselines/middle.py", "import plant", "import logs as plant", "baselines/middle.py:through"),
        ("baselines/pid.py", "self.GAIN *", "self.GAIN +", "baselines/pid.py:PID"),
        ("baselines/staged.py", "1.0", "2.0", "baselines/staged.py:Staged"),
        ("baselines/patches.py", '"b"', '"a"', "baselines/patches.py:patch"),
        ("baselines/patches.py", "\npatch()\n", "\npatch() or patch()\n", "baselines/patches.py:<import>"),
    ],
    ids=str,
)
def test_an_edit_of_what_is_called_is_named(tree, file, old, new, named):
    before = result()
    tree(file, old, new)
    assert named in changed(before, [MEASURE])


@pytest.mark.parametrize(
    ("entry", "old", "new", "stale"),
    [
        ("pid", "self.GAIN *", "self.GAIN +", True),
        ("other", '"gain": 1.0', '"gain": 2.0', True),
        ("other", "return 0.0", "return 1.0", True),
        ("other", "Three gains.", "Gains.", True),
        ("pid", "One of many.", "One.", False),
        ("a", "One of many.", "One.", True),
        ("a", '"gain": 1.0', '"gain": 2.0', False),
    ],
)
def test_an_entry_that_was_used_counts_with_its_options_and_what_it_calls(tree, entry, old, new, stale):
    before = result(used={f"controller={entry}": "baselines.pid"})
    tree("baselines/pid.py", old, new)
    assert bool(changed(before, [MEASURE])) is stale


def test_who_makes_environments_by_id_calls_what_registers_the_ids(tree):
    made = SimpleNamespace(__module__="birthsim_env.env", __qualname__="made")
    before = result([made])
    tree("birthsim_env/env.py", "1.0", "2.0")
    assert changed(before, [made]) == ["birthsim_env/env.py:Env"]
    before = result([made])
    tree("agents/residual.py", "pass", "step = 1")
    assert changed(before, [made]) == [], "a package above registers for those who import it"
    tree("birthsim_env/ids.py", '"Circle"', '"Probe"')
    assert changed(before, [made]) == ["birthsim_env/ids.py:register_id"]


def test_an_entry_that_moved_away_makes_a_result_stale(tree):
    before = result()
    tree("baselines/pid.py", 'controller="pid"', 'controller="ipd"')
    assert changed(before, [MEASURE])


def test_a_file_edited_while_work_goes_on_is_not_taken_for_what_worked(tree, tmp_path):
    definitions.take_stock()
    path = tmp_path / "birthsim_env" / "plant.py"
    path.write_text(path.read_text().replace("* limit", "+ limit"))
    before = result()
    tree("birthsim_env/plant.py")
    assert "birthsim_env/plant.py:advance" in changed(before, [MEASURE])
