"""The leaderboard: entries keep the rules, run no code, repeat bit for bit, and the tables are theirs."""

import json

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from scipy.stats import gmean

import birthsim
from birthsim.benchmark.row import overall
from birthsim.benchmark.scoring import judge, plan
from birthsim.benchmark.suites import SUITES
from lab.engine.shelf import DATA
from lab.studies.leaderboard import entries, records, repeat, who
from lab.studies.leaderboard.gains import gains
from lab.studies.leaderboard.seeds import seeds

PID = entries.ENTRIES / "pid.json"
REPEATED = {"pid": 3, "circle_honest_apg": 3}
"""Entry -> episodes that each commit repeats."""


@pytest.fixture(scope="module")
def known():
    return records.every_entry()


def test_the_tables_are_those_of_the_entries():
    for path, text in repeat.pages().items():
        assert path.read_text(encoding="utf-8") == text, path


@pytest.mark.parametrize("path", entries.entries(), ids=lambda path: path.stem)
def test_every_entry_keeps_the_rules(path):
    assert entries.against_rules(entries.entry(path), path) == ""


def test_the_projects_own_entries_are_those_that_it_declares():
    for name, (policy, tasks) in entries.own_entries().items():
        said = entries.entry(entries.ENTRIES / f"{name}.json")
        assert (said["entry"], said["given"], repeat.tasks_of(said)) == (name, [policy], tasks)


def test_there_is_what_the_benchmark_promises(known):
    learned = [name for name, said in known.items() if len(said["kinds"]) == 5 and "controller" not in said["kinds"]]
    assert len(known) >= 12
    assert len(learned) >= 6
    for tasks in SUITES.values():
        for task in tasks:
            assert len(records.standings(task.name, known)) >= 5, task.name


@pytest.mark.parametrize("suite", SUITES)
def test_a_record_is_the_highest_score_and_entries_are_ordered(suite, known):
    for task in SUITES[suite]:
        scores = {
            name: row["score"]["value"] for name, said in known.items() for row in said["tasks"] if row["task"] == task.name
        }
        own = records.standings(task.name, known)
        assert own[0].score == max(scores.values())
        assert [one.score for one in own] == sorted(scores.values(), reverse=True)
        line = next(line for line in records.records(suite, known).splitlines() if f"`{task.name}`" in line)
        assert own[0].name in line.split(" | ")[2]
        assert (line.split(" | ")[1] == "solved") == (own[0].row["success"]["value"] >= 0.95)


def test_every_environment_has_a_piece_that_names_its_records():
    said = records.record("BirthSIM/Circle-v2")
    for task in ("circle-ideal", "circle-lab", "circle-honest", "circle-honest-no-force", "circle-honest-wide"):
        assert f"`{task}`" in said
    assert "| `rail-encoders` | `rail` |" in records.record("BirthSIM/Rail-v0")
    assert records.record("BirthSIM/RailResidual-v0").startswith("No task")


def test_each_seed_learns_a_rail_in_a_minute_to_three_tenths_of_a_millimetre(known):
    table = seeds("rail-ideal", "rail_apg", ("pid",), known)
    rows = [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]
    assert [row[0] for row in rows] == [*(f"`rail_apg seed_{k}`" for k in range(5)), "`pid`"]
    errors = next(row for row in known["rail_apg"]["tasks"] if row["task"] == "rail-ideal")["errors"]
    for (_, seconds, median, _, largest, lost), own in zip(rows[:5], errors, strict=True):
        assert float(seconds) < 60
        assert float(median) == pytest.approx(np.median(own), rel=5e-3)
        assert float(largest) == pytest.approx(max(own), rel=5e-3)
        assert float(median) < 0.3
        assert lost == "0 of 64"


def test_a_gain_is_the_ratio_of_geometric_means_in_the_same_worlds(known):
    rows = [line.strip("| ").split(" | ") for line in gains(known).splitlines()[2:]]
    (own,) = [row for row in rows if row[:2] == ["`dystocia-lab`", "`honest_apg`"]]
    assert own[2] == "`admittance-adaptive`"
    one, its = (
        next(row for row in known[name]["tasks"] if row["task"] == "dystocia-lab")
        for name in ("honest_apg", "admittance-adaptive")
    )
    worlds = [k for k in range(64) if k not in one["infeasible"]]
    assert one["lost"] == [0] * 5
    means = [gmean([run[k] for k in worlds]) for run in (*one["errors"], *its["errors"])]
    assert own[4] == ", ".join(f"{100 * (mean / means[-1] - 1):+.0f}" for mean in means[:-1])
    whole, low, high = (float(word) for word in own[3].replace("[", "").replace("]", "").replace(",", "").split())
    assert whole == pytest.approx(100 * (gmean(means[:-1]) / means[-1] - 1), abs=0.5)
    assert low < whole < high


def test_an_entry_of_files_says_what_it_senses_where_its_training_tells(known):
    said = known["sac"]
    assert who.facts(said) == ["default", "no", "yes"]
    assert who.facts({**said, "training": [None] * 5}) == ["default", "-", "-"]
    on_law = [{"settings": {"law": "admittance-adaptive"}, "steps": 1, "seconds": 1.0}] * 5
    assert who.facts({**said, "training": on_law}) == ["default", "-", "-"]
    blind = [{**one, "task": "circle-honest-no-force"} for one in said["tasks"]]
    assert who.facts({**said, "tasks": blind}) == ["default", "no", "no"]


def test_a_suite_has_a_score_only_where_all_its_tasks_are(known):
    ranking = (DATA / "leaderboard-open.md").read_text(encoding="utf-8").partition("Records")[0]
    assert "| pid |" in ranking
    assert "circle_honest_apg" not in ranking
    rows = {one["task"]: one for one in known["pid"]["tasks"]}
    whole = overall([rows[task.name] for task in SUITES["open"]])
    assert f"| pid | {whole['iqm']:.1f} [" in ranking


def changed(folder, name="own", **parts):
    """An entry in a folder of its own with other parts."""
    said = json.loads(PID.read_text(encoding="utf-8"))
    said["tasks"] = said["tasks"][:1]
    (folder / f"{name}.json").write_text(json.dumps({**said, **parts}), encoding="utf-8")
    return folder / f"{name}.json"


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"seed": 3}, "seed = 3; allowed: 80000"),
        ({"split": "train"}, "split = 'train'; allowed: 'test'"),
        ({"episodes": 8}, "episodes = 8; allowed: 64"),
        ({"format": "birthsim-score-1"}, "format = 'birthsim-score-1'; allowed: 'birthsim-score-2'"),
        ({"policy_period": [0.0]}, "policy_period = [0.0]; allowed: "),
        ({"kinds": ["controller"] * 2}, "errors of "),
    ],
)
def test_what_breaks_a_rule_is_named(parts, said, tmp_path):
    assert repeat.problem(changed(tmp_path, **parts)).startswith(said)


def test_tasks_and_errors_are_those_of_the_benchmark(tmp_path):
    (task,) = json.loads(changed(tmp_path).read_text())["tasks"]
    for own, said in (
        ({"task": "moon-ideal"}, "task = 'moon-ideal'; allowed: "),
        ({"errors": [task["errors"][0][:-1]]}, "errors of "),
        ({"errors": [["good"] * 64]}, "error = 'good'; allowed: a number"),
    ):
        assert repeat.problem(changed(tmp_path, tasks=[{**task, **own}])).startswith(said)
    assert repeat.problem(changed(tmp_path, tasks=[task, task])).endswith("allowed: each once")


MARK = "from pathlib import Path\nPath(__file__).with_name('ran').touch()\nclass Own: pass\n"


@pytest.mark.parametrize(
    "given",
    [
        "own.py:Own",
        "own/own.py:Own",
        "{elsewhere}/own.py:Own",
        "../elsewhere/policy.onnx",
        "own.zip",
        "link.onnx",
        "linked",
        "gone.onnx",
        "gone",
        "residual",
        "residual:../elsewhere",
        "residual[policy={elsewhere}]",
        "{{task}}.py:Own",
        "--out=x",
        "pid[bandwidth=nan]",
        "pid[bandwith=60]",
        "pid[bandwidth=60",
        "",
        "pid\n",
        "backsteping",
    ],
)
def test_an_entry_names_nothing_but_what_is_registered_and_data_beside_it(given, tmp_path, monkeypatch):
    beside, elsewhere = tmp_path / "entries", tmp_path / "elsewhere"
    for folder in (beside / "own", elsewhere):
        folder.mkdir(parents=True)
        for file in ("own.py", "own.zip", "policy.onnx"):
            (folder / file).write_text(MARK)
    (beside / "own" / "link.onnx").symlink_to(elsewhere / "policy.onnx")
    (beside / "own" / "linked").symlink_to(elsewhere)
    monkeypatch.setattr(repeat, "plan", lambda *_: pytest.fail("it was run"))
    said = repeat.problem(changed(beside, given=[given.format(elsewhere=elsewhere)]))
    assert said.startswith("given = ")
    assert "allowed" in said
    assert not list(tmp_path.rglob("ran"))


@pytest.mark.parametrize("given", ["pid[bandwidth=60]", "limited:pid", "admittance-adaptive", "circle", "{scenario}_apg"])
def test_an_entry_may_name_what_is_registered(given, tmp_path):
    path = changed(tmp_path, given=[given])
    said = entries.entry(path)
    assert entries.against_rules(said, path) == ""
    assert entries.policies_of(said, path) == [given]


@pytest.mark.parametrize(
    "text",
    ["", "{", "[1]", "{}", '{"results": 1}', '{"tasks": [1]}', '{"a":' * 9000, '{"a": 1' + "0" * 400 + "}"],
    ids=range(8),
)
def test_a_damaged_entry_is_named_and_costs_the_others_nothing(text, tmp_path, monkeypatch, capsys):
    (tmp_path / "x.json").write_text(text)
    with pytest.raises(ValueError, match=r"^entry = .*x\.json' is damaged.*; allowed: "):
        repeat.problem(tmp_path / "x.json")
    monkeypatch.setattr(entries, "ENTRIES", tmp_path)
    with pytest.raises(SystemExit):
        repeat.main(repeat.Settings())
    assert capsys.readouterr().out.startswith("'x': entry = ")


def test_a_policy_as_data_beside_its_entry_repeats_and_says_how_it_was_trained(tmp_path):
    """What a stranger does: score an ONNX file, put row and weights into the folder of entries."""
    (tmp_path / "own").mkdir()
    weights = np.random.default_rng(2).normal(0.0, 0.02, (24, 4)).astype(np.float32)
    made = helper.make_graph(
        [helper.make_node("MatMul", ["seen", "w"], ["sum"]), helper.make_node("Tanh", ["sum"], ["actions"])],
        "policy",
        [helper.make_tensor_value_info("seen", TensorProto.FLOAT, ["n", 24])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, ["n", 4])],
        [numpy_helper.from_array(weights, "w")],
    )
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.save(model, tmp_path / "own" / "policy.onnx")
    training = {"settings": {"algorithm": "guessing"}, "steps": 7, "seconds": 0.5}
    (tmp_path / "own" / "policy.json").write_text(json.dumps(training))
    scored = birthsim.score(tmp_path / "own" / "policy.onnx", tasks=["probe-lab"], name="own", progress=False)
    assert scored.row["training"] == [training]
    path = tmp_path / "own.json"
    path.write_text(json.dumps(scored.row))
    assert repeat.problem(path, 3) == ""
    weights *= 1.5
    made.initializer[0].CopyFrom(numpy_helper.from_array(weights, "w"))
    onnx.save(
        helper.make_model(made, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), tmp_path / "own" / "policy.onnx"
    )
    assert repeat.problem(path, 3) == "other sha256 and errors of probe-lab here"


@pytest.mark.parametrize("name", REPEATED)
def test_a_stored_entry_repeats_in_every_bit(name):
    """Each commit: a classical and a learned one, in the first worlds of one of their tasks."""
    path = entries.ENTRIES / f"{name}.json"
    said = entries.entry(path)
    task = said["tasks"][0]
    own = plan(
        entries.policies_of(said, path), None, "ideal", True, None, [task["task"]], REPEATED[name], "test", 0.01, None, name
    )
    again = judge(own, None, 1, None, False).row
    assert again["tasks"][0]["errors"] == [run[: REPEATED[name]] for run in task["errors"]]
    assert again["sha256"][0] == said["sha256"][0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [pytest.param(path, id=path.stem, marks=() if path.stem in REPEATED else pytest.mark.weekly) for path in entries.entries()],
)
def test_every_entry_repeats(path):
    assert repeat.problem(path) == ""


def test_a_value_that_differs_by_its_last_bit_is_found(tmp_path):
    path = changed(tmp_path, sha256=[[""]])
    said = json.loads(path.read_text())
    assert repeat.problem(path, 3) == ""
    errors = said["tasks"][0]["errors"][0]
    errors[0] = float(np.nextafter(errors[0], np.inf))
    path.write_text(json.dumps(said))
    assert repeat.problem(path, 3) == f"other errors of {said['tasks'][0]['task']} here"
