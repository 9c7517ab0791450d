"""birthsim train: a policy that birthsim evaluate runs, resuming, several seeds side by side, and Ctrl-C."""

import signal

import numpy as np
import pytest

from agents.policy.files import WEIGHTS, read_policy
from agents.training.checkpoint import NAME as CHECKPOINT
from tests.console import RESIDUAL, assert_picture, call, interrupted, run, strict
from tests.training.left import checkpoint_left


@pytest.mark.slow
@pytest.mark.usefixtures("brief")
def test_train_writes_a_policy_that_evaluate_runs_beside_the_law(trained, tmp_path, monkeypatch, capsys):
    folder, done = trained
    assert done.returncode == 0, done.stderr
    assert [path.name for path in folder.iterdir()] == ["seed_12"]
    own = folder / "seed_12"
    assert {path.name for path in own.iterdir()} - {".lock"} == {WEIGHTS, CHECKPOINT, "training.json", "tensorboard"}
    reached, policy = strict(own / "training.json"), read_policy(own)
    assert policy.training["reached"] == reached["policy"]
    assert (policy.environment, policy.settings.authority, policy.training["seed"]) == (RESIDUAL, 60.0, 12)
    assert (reached["settings"]["steps"], reached["settings"]["authority"], reached["settings"]["lanes"]) == (4096, 60.0, 32)
    assert reached["policy"]["pooled_mm"] < reached["law"]["pooled_mm"]
    assert f"{'backstepping':26}{reached['law']['pooled_mm']:7.2f} mm{reached['law']['tail_mm']:7.2f} mm" in done.stdout
    assert f"{'seed 12':26}{reached['policy']['pooled_mm']:7.2f} mm" in done.stdout
    assert "% below" in done.stdout
    assert f"written to {folder}/" in done.stdout
    assert "seed 12: " in done.stderr  # the progress bar
    assert "% better" in done.stderr
    assert "Warning" not in done.stderr
    medians = []
    for name, arguments, place in (("named", ("--controller", "residual"), folder), ("unnamed", (), own)):
        options = ("--env", "BirthSIM/Probe-v3", "--policy", place, "--episodes", 2, "--seed", 900, "--out", tmp_path / name)
        status, printed, _ = call("evaluate", monkeypatch, capsys, *arguments, *options)
        assert status == 0
        assert "residual: median" in (tmp_path / name / "evaluation.md").read_text()
        assert "\nresidual  " in printed
        results = strict(tmp_path / name / "evaluation.json")["results"]
        assert [result["controller"] for result in results] == ["backstepping", "residual"]
        medians.append([result["episodes"]["settled_rms"] for result in results])
        assert results[0]["required_strength_ratio"] == results[1]["required_strength_ratio"]
    assert medians[0] == medians[1]
    assert not np.array_equal(*medians[0])


def test_train_goes_on_where_its_folder_stopped_and_refuses_a_policy_from_elsewhere(
    trained, small, tmp_path, monkeypatch, capsys
):
    folder, _ = trained
    options = ("--config", small, "--steps", 4096, "--seed", 12, "--authority", 60)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and "tfevents" not in path.name}
    status, printed, _ = call("train", monkeypatch, capsys, *options, "--out", folder)
    assert status == 0, "a training that is over is reported once more"
    assert "seed 12: 4,096 of 4,096 steps are there and are kept\n" in printed
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and "tfevents" not in path.name}
    assert after == before
    # A policy that came from elsewhere is not written over.
    for name in (WEIGHTS, "training.json"):
        own = tmp_path / name.partition(".")[0] / "seed_12"
        own.mkdir(parents=True)
        (own / name).write_bytes((folder / "seed_12" / name).read_bytes())
        status, _, complained = call("train", monkeypatch, capsys, *options, "--out", own.parent)
        assert status == 2
        assert complained.endswith(f"/seed_12' has {name} but not its {CHECKPOINT}; allowed: another folder\n")


@pytest.mark.slow
def test_train_runs_several_seeds_side_by_side_and_evaluate_takes_them_together(tmp_path, small, monkeypatch, capsys):
    options = ("--config", small, "--steps", 1024, "--randomize", "plant", "--sensors", "lab", "--impedance", "variable_kp")
    done = run("train", *options, "--seed", 5, "--seeds", 2, "--jobs", 2, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "leaked" not in done.stderr
    reached = [strict(tmp_path / "out" / f"seed_{seed}" / "training.json") for seed in (5, 6)]
    for seed, one in zip((5, 6), reached, strict=True):
        settings = one["settings"]
        assert (settings["seed"], settings["randomize"], settings["sensors"]) == (seed, "plant", "lab")
        assert (settings["impedance"], settings["law"], settings["algorithm"]) == ("variable_kp", "backstepping", "ppo")
        assert f"{f'seed {seed}':26}{one['policy']['pooled_mm']:7.2f} mm" in done.stdout
        assert f"seed {seed}: 100%" in done.stderr
    assert reached[0]["law"] == reached[1]["law"]
    assert reached[0]["curve"][-1]["pooled_mm"] != reached[1]["curve"][-1]["pooled_mm"]
    # A seed trained alone, in this very process, becomes the same policy.
    status, _, complained = call("train", monkeypatch, capsys, *options, "--seed", 6, "--out", tmp_path / "alone")
    assert status == 0, complained
    alone, together = ((tmp_path / place / "seed_6" / WEIGHTS).read_bytes() for place in ("alone", "out"))
    assert alone == together
    evaluate = ("--env", "BirthSIM/Probe-v3", "--policy", tmp_path / "out", "--episodes", 1, "--out", tmp_path / "evaluated")
    status, printed, complained = call("evaluate", monkeypatch, capsys, *evaluate)
    assert status == 0, complained
    assert "residual, 2 seeds " in printed
    assert "2 training seeds" in (tmp_path / "evaluated" / "evaluation.md").read_text()
    results = strict(tmp_path / "evaluated" / "evaluation.json")["results"]
    assert [result["controller"] for result in results] == ["backstepping", "residual seed_5", "residual seed_6"]
    assert_picture(tmp_path / "evaluated", "learning_curves")


@pytest.mark.slow
@pytest.mark.parametrize(("jobs", "ending"), [(1, signal.SIGINT), (2, signal.SIGTERM)])
def test_a_signal_during_training_keeps_what_every_seed_has_learned_and_says_so(jobs, ending, tmp_path, small):
    """It comes after the first steps of each seed, long before the next validation."""
    folders = [tmp_path / f"seed_{seed}" for seed in range(jobs)]
    arguments = ("--config", small, "--steps", 10**8, "--seeds", jobs, "--jobs", jobs, "--out", tmp_path)

    def learning():
        return all(any(b"time/fps" in path.read_bytes() for path in folder.rglob("events*")) for folder in folders)

    status, printed = interrupted("train", arguments, learning, ending)
    assert status == 128 + ending
    for folder in folders:
        steps, seed = checkpoint_left(folder)["counts"][0], folder.name.replace("_", " ")
        assert steps > 0
        assert f"{seed}: interrupted; {steps:,} of 100,000,000 steps are kept in {folder}/" in printed
        assert read_policy(folder).environment == RESIDUAL
