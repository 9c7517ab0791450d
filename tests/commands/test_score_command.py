"""birthsim score: its row against what other code reaches on the same worlds, suites, several seeds, and what is kept."""

import json

import gymnasium
import numpy as np
import pytest
from scipy.stats import gmean, trim_mean

import birthsim
from agents.policy.seeds import policy_folders
from baselines.bench.statistics import interquartile_mean, penalize_lost, stratified_interval
from birthsim.benchmark.scale import BEST, SHUT, counted_error, ends, factor_per_point, score_of
from birthsim.benchmark.scoring import plan
from birthsim.benchmark.suites import SUITES, TASKS, find_suite, find_task, task_of
from birthsim_env.splits import TEST
from tests.console import OWN, call, strict

PROBE, RAIL = "BirthSIM/Probe-v3", "BirthSIM/Rail-v0"
STILL = """
import numpy as np

def still(observations):
    return np.zeros((len(observations), 4))

class Pushes:
    def __init__(self):
        self.called = 0
    def __call__(self, observations):
        self.called += 1
        return np.full((len(observations), 4), 0.3 if self.called % 2 else -0.3)
"""


def test_a_row_says_what_an_evaluation_reaches(tmp_path, monkeypatch, capsys):
    given = ("backstepping", "--env", PROBE, "--sensors", "lab", "--episodes", 6, "--jobs", 1, "--out", tmp_path / "out")
    status, printed, complained = call("score", monkeypatch, capsys, *given)
    assert status == 0, complained
    assert "warning" not in complained
    row = strict(tmp_path / "out" / "score.json")
    assert (row["entry"], row["kinds"], row["split"], row["seed"]) == ("backstepping", ["controller"], "test", TEST.first)
    found = birthsim.evaluate(PROBE, "backstepping", episodes=6, seed=80_000, sensors="lab", randomize=True, progress=False)
    (one,) = row["tasks"]
    within = np.array(found.required_strength_ratio) <= 0.9
    errors = np.array(found.metrics["settled_rms"])[within]
    shut, best = (ends("probe-lab")[role]["error_mm"] for role in (SHUT, BEST))
    score = 100 * np.log(shut / gmean(errors)) / np.log(shut / best)
    assert one["score"]["value"] == pytest.approx(score)
    assert one["scores"] == pytest.approx([score])
    assert one["score"]["low"] < score < one["score"]["high"]
    assert one["error_mm"]["value"] == pytest.approx(np.median(errors))
    assert one["errors"] == [found.metrics["settled_rms"]]
    assert one["infeasible"] == np.flatnonzero(~within).tolist()
    assert one["returns"] == pytest.approx([np.mean(found.returns[1.0])])
    assert one["success"]["value"] == pytest.approx(np.mean(np.array(found.success)[within]))
    assert one["lost"] == [0]
    assert row["seconds"] > 0
    assert f"{score:.1f} [" in printed
    assert "probe-lab" in printed


def test_infeasible_worlds_count_for_nothing(monkeypatch):
    """On a heavy rig, whose cylinders bear only some of the pushes."""
    heavy = birthsim.Parameters().replace({"mechanics.mass": 5.5})
    monkeypatch.setattr("birthsim.benchmark.suites.rig_for", lambda *_: heavy)
    (one,) = birthsim.score("pid", PROBE, episodes=12, progress=False).row["tasks"]
    world = {"parameters": heavy, "randomize": True, "progress": False, "episodes": 12, "seed": 80_000}
    found = birthsim.evaluate(PROBE, birthsim.make_controller("pid", heavy), **world)
    within = np.array(found.required_strength_ratio) <= 0.9
    assert 0 < within.sum() < 12
    assert one["infeasible"] == np.flatnonzero(~within).tolist()
    assert one["success"]["value"] == pytest.approx(np.mean(np.array(found.success)[within]))
    errors = np.array(penalize_lost(found.metrics["settled_rms"], found.lost))
    assert one["error_mm"]["value"] == pytest.approx(np.median(errors[within]))
    shut, best = (ends("probe-ideal")[role]["error_mm"] for role in (SHUT, BEST))
    mean = gmean(counted_error(found.metrics["settled_rms"], found.lost)[within])
    assert one["score"]["value"] == pytest.approx(100 * np.log(shut / mean) / np.log(shut / best))


def test_a_lost_episode_is_as_bad_as_any_error_and_no_error_is_better_than_the_least():
    assert counted_error([0.5, 0.5, 300.0, 0.0, np.nan], [False, True, False, False, True]).tolist() == [
        0.5,
        100,
        100,
        1e-3,
        100,
    ]
    assert np.isnan(counted_error([np.nan], [False])).all()


@pytest.mark.parametrize("task", TASKS)
def test_every_task_has_a_scale_of_which_a_point_resolves_a_tenth_of_an_error(task):
    known = ends(task)
    shut, best = (known[role]["error_mm"] for role in (SHUT, BEST))
    assert score_of(task, [shut, best, np.sqrt(shut * best)]) == pytest.approx([0, 100, 50])
    factor = factor_per_point(task)
    assert score_of(task, best / factor) == pytest.approx(101)
    assert 1.01 < factor < 1.1
    for one in known.values():
        assert one["low"] < one["error_mm"] < one["high"]
        assert one["episodes"] > 100
    assert find_task(task).is_scored


def test_a_task_of_no_suite_has_success_and_errors_but_no_score(tmp_path, monkeypatch, capsys):
    given = ("pid", "--env", RAIL, "--sensors", "honest", "--episodes", 2, "--jobs", 1, "--out", tmp_path / "out")
    status, printed, complained = call("score", monkeypatch, capsys, *given)
    assert status == 0, complained
    assert "no score: only tasks of the suites have a scale" in printed
    row = strict(tmp_path / "out" / "score.json")
    (one,) = row["tasks"]
    assert (one["score"], one["scores"], row["overall"]) == (None, None, None)
    assert one["success"]["value"] is not None
    assert one["error_mm"]["value"] > 0


def test_tasks_are_chosen_by_name(tmp_path, monkeypatch, capsys):
    given = ("shut-valves", "--tasks", "probe-lab", "probe-ideal", "--episodes", 2, "--jobs", 1, "--out", tmp_path / "out")
    status, printed, complained = call("score", monkeypatch, capsys, *given)
    assert status == 0, complained
    row = strict(tmp_path / "out" / "score.json")
    assert [one["task"] for one in row["tasks"]] == ["probe-lab", "probe-ideal"]
    assert row["tasks"][0]["errors"] == row["tasks"][1]["errors"], "shut valves look at no sensor"
    assert row["given"] == ["shut-valves"]
    assert "interquartile mean of 2 tasks" in printed
    every = plan("pid", None, "ideal", True, "all", None, 1, 0, 0.01, None, None)
    assert every.tasks == (*SUITES["classic"], *SUITES["open"])
    with pytest.raises(ValueError, match=r"suite = 'clasic' .*allowed: classic, open, rail, all"):
        find_suite("clasic")


def test_several_policies_are_the_seeds_of_one_entry(tmp_path, monkeypatch, capsys):
    (tmp_path / "own.py").write_text(STILL)
    monkeypatch.chdir(tmp_path)
    given = ("own.py:still", "own.py:Pushes", "--env", PROBE, "--episodes", 2, "--jobs", 1, "--name", "mine", "--out", "out")
    status, _, complained = call("score", monkeypatch, capsys, *given)
    assert status == 0, complained
    row = strict(tmp_path / "out" / "score.json")
    assert (row["entry"], row["policies"], row["kinds"]) == ("mine", ["own.py:still", "own.py:Pushes"], ["policy", "policy"])
    assert str(tmp_path) not in json.dumps(row), "no place of this machine"
    alone = [birthsim.score(f"own.py:{name}", PROBE, episodes=2, progress=False).row for name in ("still", "Pushes")]
    assert row["tasks"][0]["scores"] == [one["tasks"][0]["scores"][0] for one in alone]
    assert row["overall"]["over"] == "runs"
    assert row["overall"]["iqm"] == pytest.approx(np.mean(row["tasks"][0]["scores"]))
    assert alone[0]["overall"]["over"] == "episodes"


def test_a_row_knows_the_seeds_of_a_trained_folder_and_what_a_task_is_called():
    row = birthsim.score("circle", "BirthSIM/Circle-v2", episodes=1, progress=False).row
    assert row["policies"] == [f"circle seed_{k}" for k in range(5)]
    assert set(row["kinds"]) == {"residual"}
    assert len(set(row["sha256"][0])) == 5
    assert row["tasks"][0]["task"] == "circle-ideal"
    assert row["tasks"][0]["success"]["value"] == 1.0
    said = [json.loads((one / "training.json").read_text()) for one in policy_folders("circle")]
    assert [one["settings"]["seed"] for one in row["training"]] == list(range(5))
    assert [one["steps"] for one in row["training"]] == [one["curve"][-1]["steps"] for one in said]


def test_a_place_stands_for_the_name_of_a_scenario():
    row = birthsim.score("{scenario}_apg", tasks=["probe-ideal", "circle-lab"], episodes=1, progress=False).row
    for one, policy in zip(row["tasks"], ("probe_apg", "circle_apg"), strict=True):
        alone = birthsim.score(policy, tasks=[one["task"]], episodes=1, progress=False).row
        assert alone["tasks"][0]["errors"] == one["errors"]
        assert alone["sha256"][0] in row["sha256"]


def test_what_is_complete_is_kept(tmp_path, monkeypatch, capsys):
    """A suite of two tasks whose second fails at first: the first is not run again."""
    (tmp_path / "own.py").write_text(STILL)
    tasks = tuple(task_of(PROBE, sensors, True) for sensors in ("ideal", "lab"))
    monkeypatch.setitem(SUITES, "classic", tasks)
    ran = []
    interrupted = [True]

    def evaluated(*arguments, before=gymnasium.make_vec, **options):
        if "sensors" in options:
            ran.append(options["sensors"])
            if options["sensors"] == "lab" and interrupted:
                interrupted.pop()
                raise KeyboardInterrupt
        return before(*arguments, **options)

    monkeypatch.setattr(gymnasium, "make_vec", evaluated)
    given = (f"{tmp_path}/own.py:still", "--suite", "classic", "--episodes", 1, "--jobs", 1, "--out", tmp_path / "out")
    status, _, _ = call("score", monkeypatch, capsys, *given)
    assert status == 130
    assert ran == ["ideal", "lab"]
    assert not (tmp_path / "out" / "score.json").exists()
    status, printed, complained = call("score", monkeypatch, capsys, *given)
    assert status == 0, complained
    assert "1 of 2 are there" in printed
    assert ran == ["ideal", "lab", "lab"]
    assert [one["task"] for one in strict(tmp_path / "out" / "score.json")["tasks"]] == ["probe-ideal", "probe-lab"]


def test_a_place_stands_for_the_name_of_each_task(tmp_path, monkeypatch):
    monkeypatch.setitem(SUITES, "classic", tuple(task_of(PROBE, sensors, True) for sensors in ("ideal", "lab")))
    monkeypatch.chdir(tmp_path)
    for name, opening in (("probe-ideal", 0.0), ("probe-lab", 0.3)):
        (tmp_path / f"{name}.py").write_text(
            f"import numpy as np\ndef act(seen):\n    return np.full((len(seen), 4), {opening})\n"
        )
    both = birthsim.score("{task}.py:act", suite="classic", episodes=1, progress=False).row
    alone = birthsim.score("probe-lab.py:act", PROBE, sensors="lab", episodes=1, progress=False).row
    assert both["tasks"][1]["score"] == alone["tasks"][0]["score"]
    assert both["tasks"][0]["error_mm"] != both["tasks"][1]["error_mm"]
    with pytest.raises(ValueError, match=r"missing-probe-ideal\.py"):
        birthsim.score("missing-{task}.py:act", suite="classic", episodes=1, progress=False)


@pytest.mark.parametrize("task", [task for tasks in SUITES.values() for task in tasks], ids=lambda task: task.name)
def test_every_task_of_a_suite_begins(task):
    world = task.world
    rig = birthsim.Parameters.from_dict(world["parameters"]) if "parameters" in world else task.rig
    worlds = birthsim.make_vec(task.environment, num_envs=3, **{**world, "parameters": rig})
    worlds.reset(seed=TEST.first)
    drawn = worlds.simulation.plant.lane_parameters
    assert len({tuple(column) for column in drawn.T}) == 3, "rigs are drawn"
    assert (np.abs(worlds.measurement.user_force).max() == 0.0) >= (not task.force_sensor)
    worlds.close()


def test_one_cylinder_has_a_suite_of_its_own_and_policies_of_two_are_refused_there():
    kinds = {suite: {task.rig.linkage.kind for task in tasks} for suite, tasks in SUITES.items()}
    assert kinds == {"classic": {"two-cylinders"}, "open": {"two-cylinders"}, "rail": {"rail"}}
    with pytest.raises(ValueError, match=r"maps 36 to 4 numbers; allowed: 18 to 2"):
        birthsim.score("circle_apg", suite="rail", episodes=1, progress=False)


def test_tasks_have_names_of_their_own_and_say_what_differs():
    tasks = [task for tasks in SUITES.values() for task in tasks]
    assert len({task.name for task in tasks}) == len(tasks)
    wide = next(task for task in tasks if task.name == "circle-honest-wide")
    assert wide.world["parameters"]["randomize"]["mechanics.mass"] == [1.0, 10.0]
    assert wide.rig == birthsim.Parameters(), "what controllers believe"
    friction = next(task for task in tasks if task.name == "probe-honest-friction")
    assert friction.world["parameters"]["randomize"]["friction"] == "drawn"


def test_the_interval_of_all_tasks_is_that_of_rliable():
    """Its definition, written anew: runs are drawn within each task, and the mean of the middle half of all is taken."""
    rng = np.random.default_rng(5)
    scores = rng.normal([[20.0], [50.0], [80.0], [90.0]], [[10.0], [5.0], [20.0], [1.0]], (4, 6))
    assert interquartile_mean(scores) == pytest.approx(trim_mean(scores, 0.25, axis=None))
    drawn = [trim_mean(np.stack([row[rng.integers(6, size=6)] for row in scores]), 0.25, axis=None) for _ in range(4000)]
    low, high = stratified_interval(interquartile_mean, scores)
    assert (low, high) == pytest.approx(np.percentile(drawn, [2.5, 97.5]), abs=0.6)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"suite": "opne"}, r"suite = 'opne'.*; allowed: classic, open"),
        ({"suite": "open", "environment": PROBE}, r"environment = .* with suite = .*; allowed: one of them"),
        ({"suite": "open", "tasks": ["probe-lab"]}, r"suite = .* with tasks = .*; allowed: one of them"),
        ({"tasks": ["prob-lab"]}, r"task = 'prob-lab'.*probe-lab.*; allowed: circle-ideal, "),
        ({"tasks": []}, r"tasks = \[\]; allowed: a list of names"),
        ({"tasks": ["probe-lab"] * 2}, r"tasks = .*; allowed: .*each once"),
        ({"tasks": ["probe-lab"], "sensors": "lab"}, r"sensors = 'lab'.* with tasks = .*; allowed: without"),
        ({"suite": "open", "sensors": "lab"}, r"sensors = 'lab'.* with suite = 'open'; allowed: without"),
        ({"suite": "open", "force_sensor": False}, r"force_sensor = False with suite = 'open'; allowed: without"),
        ({"environment": "BirthSIM/Square-v1"}, r"environment = 'BirthSIM/Square-v1'; allowed: "),
        ({"sensors": "perfect"}, r"perfect.*allowed: .*ideal"),
        ({"seed": "tset"}, r"split = 'tset'.*allowed: train, validation, scale, test"),
        ({"episodes": 0}, r"episodes = 0; allowed: "),
        ({"normalize": "x.pkl"}, r"normalize = 'x.pkl' .*allowed: with FILE.zip"),
        ({"out": 3}, r"out = 3; allowed: "),
    ],
)
def test_arguments_are_refused_by_name(options, said):
    with pytest.raises(ValueError, match=said):
        birthsim.score("shut-valves", **options)


def test_an_object_has_no_folder(tmp_path):
    with pytest.raises(ValueError, match=r"out = .* with policy = <lambda>.*allowed: without out"):
        birthsim.score(lambda seen: np.zeros((len(seen), 4)), PROBE, episodes=1, out=tmp_path, progress=False)


@pytest.mark.usefixtures("brief")
def test_worlds_that_guided_a_policy_are_named(tmp_path, monkeypatch, capsys):
    (tmp_path / "slam.py").write_text(OWN)
    given = (
        f"{tmp_path}/slam.py:Slam",
        "--env",
        PROBE,
        "--episodes",
        1,
        "--jobs",
        1,
        "--seed",
        "train",
        "--out",
        tmp_path / "out",
    )
    status, _, complained = call("score", monkeypatch, capsys, *given)
    assert status == 0, complained
    assert "seeds 2000000 to 2000000 are of the split train" in complained
    with pytest.warns(UserWarning, match=r"split validation.*seed = test"):
        birthsim.score("shut-valves", PROBE, seed="validation", episodes=1, progress=False)
