"""Splits of seeds: none shares a world with another, each is what its user takes, and commands know them by name."""

import itertools

import pytest

from agents.training.student import LANES, SEED, SPACING
from agents.training.validation import VALIDATION_SEED, training_seeds
from baselines.work.tasks import run_tasks
from birthsim.commands import tune
from birthsim_env.splits import GUIDING, SPLITS, TEST, TRAIN, VALIDATION, caution, find_split, first_seed, split_of
from lab.engine import worlds
from lab.studies.leaderboard.entries import RULES
from lab.studies.scores import scale
from lab.studies.scores.study import STUDY
from tests.console import OWN, call

PROBE = "BirthSIM/Probe-v3"


def test_no_two_splits_share_a_seed():
    ranges = sorted((own.start, own.stop) for one in SPLITS.values() for own in one.ranges)
    assert all(before[1] <= after[0] for before, after in itertools.pairwise(ranges))


@pytest.mark.parametrize(
    ("seeds", "name"),
    {
        range(32): "train",  # of PPO(seed=0) in 32 lanes
        training_seeds(0, 128): "train",
        training_seeds(199, 10_000): "train",
        range(SEED, SEED + 10 * SPACING + LANES): "train",
        range(tune.WORLDS, tune.WORLDS + tune.LANES): "train",
        range(VALIDATION_SEED, VALIDATION_SEED + 512): "validation",
        range(STUDY.options["seed"], STUDY.options["seed"] + STUDY.options["episodes"]): "scale",
        range(
            scale.STUDY.options["seed"], scale.STUDY.options["seed"] + scale.APART + scale.STUDY.options["episodes"]
        ): "scale",
        range(RULES["seed"], RULES["seed"] + RULES["episodes"]): "test",
        range(worlds.SEED, worlds.SEED + worlds.COUNT): "test",
        range(20_000, 20_064): "",
        range(9_990, 10_010): "",
    }.items(),
)
def test_whoever_uses_worlds_has_those_of_its_split(seeds, name):
    assert split_of(seeds) == name


def test_committed_results_keep_their_worlds():
    """What stood in these places before there were splits."""
    begins = VALIDATION_SEED, training_seeds(3, 8).start, RULES["seed"], STUDY.options["seed"], worlds.SEED
    assert begins == (1_000_000, 2_030_000, 80_000, 70_000, 47_000_000)


def test_a_split_stands_for_its_first_seed():
    assert [first_seed(name) for name in SPLITS] == [2_000_000, 1_000_000, 70_000, 80_000]
    assert first_seed(12) == 12
    with pytest.raises(ValueError, match=r"split = 'tests'.*test.*allowed: train, validation, scale, test"):
        find_split("tests")


def test_a_caution_names_the_split_and_what_to_use():
    assert caution(range(80_000, 80_064)) == caution(range(20_000, 20_001)) == ""
    for seeds, own in ((range(9_999, 10_100), TRAIN), (range(1_999_999, 2_000_000), VALIDATION)):
        said = caution(seeds)
        assert own.name in said
        assert "--seed test" in said
        assert f"{seeds.start} to {seeds.stop - 1}" in said
        assert caution(seeds, [one for one in GUIDING if one is not own]) == ""


@pytest.mark.usefixtures("brief")
@pytest.mark.parametrize(
    ("controller", "seed", "met"),
    [
        ("shut-valves", "0", ""),
        ("shut-valves", "1000000", "validation"),
        ("shut-valves", "test", ""),
        ("slam.py:Slam", "5", "train"),
        ("slam.py:Slam", "validation", "validation"),
        ("slam.py:Slam", "80000", ""),
    ],
)
def test_evaluate_says_where_worlds_have_guided_what_it_judges(controller, seed, met, tmp_path, monkeypatch, capsys):
    (tmp_path / "slam.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    seeds = []

    def run(tasks, *rest):
        seeds.extend(task.settings["seed"] for task in tasks)
        return run_tasks(tasks, *rest)

    monkeypatch.setattr("birthsim.evaluation.run_tasks", run)
    given = ("--env", PROBE, "--episodes", 1, "--jobs", 1, "--controller", controller, "--seed", seed, "--out", "out")
    status, _, complained = call("evaluate", monkeypatch, capsys, *given)
    assert status == 0, complained
    assert seeds == [first_seed(int(seed) if seed.isdecimal() else seed)]
    warned = [line for line in complained.splitlines() if "warning" in line]
    assert len(warned) == bool(met)
    assert all(f"split {met}" in line and f"--seed {TEST.name}" in line for line in warned)


def test_train_names_its_worlds_and_says_where_they_leave_their_split(small, tmp_path):
    from birthsim.training import plan, worlds_of

    inside, outside = (worlds_of(plan(small, tmp_path / str(seed), seed, 2, 1, None, {})) for seed in (1, 4500))
    assert "seeds 2010000 to 2020031 to learn, of the split train" in inside
    assert "seeds 1000000 to 1000003, of validation" in inside
    assert "warning" not in inside
    assert "warning: worlds of seed = 4500" in outside
    assert outside.endswith("allowed there: 0 to 199")
