"""The verification report: its tables name what exists, its measurements are whole, its page is the one that they make."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from lab.studies.mutation.modules import MODULES
from lab.studies.verification import balances, mutants, report, sources

TABLES = {name: report.entries(name) for name in ("equation", "promise")}
NODES = sorted({node for table in TABLES.values() for entry in table for node in entry["tests"]})


@pytest.mark.parametrize("node", NODES)
def test_every_test_named_exists(node):
    path, _, name = node.partition("::")
    assert name in sources.defined(sources.ROOT / path), f"{path} has no {name}"
    assert name.startswith("test_")


def test_tables_are_whole():
    for table in TABLES.values():
        assert all(entry["tests"] for entry in table)
        names = [entry.get("name", entry.get("text")) for entry in table]
        assert len(set(names)) == len(names) > 15


@pytest.mark.parametrize("entry", TABLES["equation"], ids=lambda entry: entry["name"])
def test_every_equation_stands_where_it_is_said_to_stand(entry):
    for place in entry["code"]:
        path, _, name = place.partition(":")
        assert name in sources.defined(sources.ROOT / path), place


@pytest.mark.parametrize("entry", TABLES["promise"], ids=lambda entry: entry["text"])
def test_every_promise_has_its_page_and_its_bounds(entry):
    assert (sources.ROOT / entry["made"]).is_file()
    texts = "".join((sources.ROOT / node.partition("::")[0]).read_text(encoding="utf-8") for node in entry["tests"])
    for what, bound in entry.get("bounds", {}).items():
        assert re.search(rf"(?<![\d.]){re.escape(bound)}(?![\d.])", texts), f"{what}: {bound} is in none of the tests' files"


def test_the_page_is_the_one_that_tables_and_measurements_make():
    """``make verify`` or ``birthsim study verification report`` writes it anew."""
    fresh, stored = report.page(), report.PAGE.read_text(encoding="utf-8")
    assert without_staleness(fresh) == without_staleness(stored)


def without_staleness(page: str) -> str:
    """Whether a measurement is stale changes with every edit of a source, and is said when the page is written."""
    page = re.sub(r" \*\*Stale\*\*: [^\n]*", "", page)
    return re.sub(r"\| (yes|no) \|$", "|", page, flags=re.MULTILINE)


def test_every_module_has_a_score_of_at_least_ninety_percent():
    measured = sources.load("mutation")
    assert list(measured) == list(MODULES)
    for module, one in measured.items():
        assert mutants.score(one) >= 0.9, module
        assert one["tried"] - one["killed"] == len(one["survivors"])


def test_every_survivor_is_judged_and_nothing_else_is():
    alive = {name: mutant for one in sources.load("mutation").values() for name, mutant in one["survivors"].items()}
    judged = mutants.judgements()
    assert set(judged) == set(alive)
    for name, judgement in judged.items():
        assert judgement["verdict"] in mutants.VERDICTS, name
        assert judgement["change"] == alive[name]["change"], f"{name} is another change now"
        assert judgement["reason"]


def test_a_changed_source_is_stale_and_a_changed_comment_is_not(tmp_path, monkeypatch):
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    file = tmp_path / "one.py"
    file.write_text('"""What."""\n\n\ndef f(x):\n    """Twice x."""\n    return 2 * x\n')
    stored = sources.digests(["one.py", "none.py"])
    file.write_text('"""What else."""\n# A remark.\ndef f(x):\n    return 2 * x\n')
    assert sources.changed(stored) == []
    file.write_text("def f(x):\n    return 3 * x\n")
    assert sources.changed(stored) == ["one.py"]
    measured = {"commit": "abc", "sources": stored}
    assert "**Stale**: 1 of 2 files have changed since." in report.basis(measured)


def test_a_summary_counts_and_lists_what_survived():
    module = "birthsim_env.physics.chambers"
    name = f"{module}:heat_flow:constant:1"
    killed = {"line": 1, "change": "a -> b", "killed_by": "tests/x.py::test_x"}
    mutated = {name: {**killed, "killed_by": None}, "other": killed}
    results = {module: {"tests": {"t": 1.0}, "left_out": {}, "every": 1, "seconds": 1.6, "mutants": mutated}}
    [(found, one)] = mutants.summary(results).items()
    assert (found, one["tried"], one["killed"], one["seconds"]) == (module, 2, 1, 2)
    assert list(one["survivors"]) == [name]
    assert {"birthsim_env/physics/chambers.py", "tests/physics/test_chambers.py"} <= set(one["sources"])
    assert mutants.score(one) == 0.5


def test_measurements_are_json_that_others_read():
    for path in sources.MEASURED.glob("*.json"):
        json.loads(path.read_text(encoding="utf-8"), parse_constant=lambda word, path=path: pytest.fail(f"{path.name}: {word}"))


@pytest.mark.slow
def test_balances_close_at_the_plants_step(monkeypatch):
    monkeypatch.setattr(balances, "SECONDS", 0.2)
    found = balances.chambers(2.5e-4, collide=False)
    assert 0 < found["mass"] < 1e-7
    assert 0 < found["energy"] < 1e-7
    assert found["pistons_at_stops"] == 0
    assert balances.adiabat()["drift"] < 1e-9
    mechanical = balances.mechanical_energy(2.5e-4)
    assert mechanical["gap"] < 1e-4
    assert mechanical["work_j"] > 1


@pytest.mark.slow
def test_stages_run_as_plain_python():
    """What mutants and coverage rely on: a whole closed loop without machine code gives the compiled openings."""
    script = (
        "import sys; from lab.studies.mutation.uncompiled import switch_off\n"
        "if len(sys.argv) > 1: switch_off()\n"
        "import numpy as np; from baselines import BacksteppingController\n"
        "from birthsim_env.physics.geometry import s_squared\n"
        "from birthsim_env.physics.rig.parameters import Parameters\n"
        "assert s_squared.py_func(2.0, 1.0) == s_squared(2.0, 1.0)\n"
        "from tests.backstepping.test_backstepping import as_signals, random_situations\n"
        "rig = Parameters(); s = random_situations(rig, 0.01, True, 5, np.random.default_rng(5))\n"
        "print(BacksteppingController(rig).command(*as_signals(s, rig)).tobytes().hex())"
    )
    said = []
    for more in ([], ["uncompiled"]):
        line = [sys.executable, "-c", script, *more]
        done = subprocess.run(line, cwd=sources.ROOT, capture_output=True, text=True, check=True)
        said.append(np.frombuffer(bytes.fromhex(done.stdout.split()[-1])))
    np.testing.assert_allclose(*said, rtol=1e-9)
