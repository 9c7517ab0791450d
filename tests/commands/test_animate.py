"""birthsim animate: both runs are those of the environments, at the same instants, and what is written plays in real time."""

import re
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from PIL import Image

import birthsim_env
from baselines.driving import driving
from baselines.named import make_controller
from birthsim import recorded
from birthsim.commands import animate
from birthsim.commands.animate import SAMPLE, take
from birthsim_env.drawing.pair import Pair
from tests.console import call
from tests.env.test_rendering import SCENE

RIG = birthsim_env.Parameters()


SHOWN = replace(SCENE, piston=(0.0, 0.02), target=(0.5, 0.0), compliant_target=(0.52, 0.0), user_force=(100.0, 0.0))


@pytest.fixture
def pair():
    return Pair(RIG, "test", ("one", "other"), (0.0, 2.0), 0.01)


@pytest.mark.parametrize("suffix", ["webp", pytest.param("gif", marks=pytest.mark.slow)])
def test_the_file_plays_both_runs_in_real_time(suffix, tmp_path, monkeypatch, capsys):
    path = tmp_path / "deeper" / f"pull.{suffix}"
    options = ("--seed", 1, "--begin", 0.5, "--end", 1.5, "--rate", 10, "--out", path)
    status, printed, _ = call("animate", monkeypatch, capsys, *options)
    assert status == 0
    with Image.open(path) as image:
        assert (image.n_frames, image.size) == (11, (960, 634))
        durations, frames = [], []
        for k in range(11):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB"), dtype=int))
            durations.append(image.info["duration"])
    assert durations[:-1] == [100] * 10
    assert image.info["loop"] == 0
    # Before the pull begins at 1 s the law alone moves; afterwards both do.
    assert np.abs(frames[10] - frames[0])[:, :480].max() > 100
    assert np.abs(frames[10] - frames[0])[:, 480:].max() > 100
    assert f"written to {path}: 11 frames" in printed
    rms = [float(value) for value in re.findall(r"([\d.]+) mm RMS", printed)]
    assert rms[0] > 2 * rms[1] > 0


def test_a_take_shows_the_run_of_the_environment():
    law = make_controller("backstepping", RIG)
    driven = gymnasium.make("BirthSIM/Forceps-v2", randomize=True, policy_period=0.001, actuation=driving(law, "it"))
    found = take(driven, 3, (0.5, 1.5), 25, lambda count: None)
    env, law = gymnasium.make("BirthSIM/Forceps-v2", randomize=True, policy_period=0.001), make_controller("backstepping", RIG)
    _, info = env.reset(seed=3)
    times, errors = [0.0], [np.hypot(*info["tracking_error"])]
    for _ in range(1500):
        _, _, _, _, info = env.step(law.command(env.unwrapped.measurement, env.unwrapped.reference))
        times.append(info["time"])
        errors.append(np.hypot(*info["tracking_error"]))
    np.testing.assert_array_equal(found.errors, errors[500 :: round(SAMPLE / 0.001)])
    np.testing.assert_allclose([scene.time for scene in found.scenes], 0.5 + 0.04 * np.arange(26))
    np.testing.assert_allclose(found.scenes[-1].piston, info["piston_position"])
    assert found.scenes[-1].user_force == pytest.approx(tuple(info["user_force"]))


def test_a_lost_run_stands_still_with_an_infinite_error():
    def taken(name):
        env = gymnasium.make("BirthSIM/Forceps-v2", policy_period=0.001, actuation=driving(make_controller(name, RIG), "it"))
        return take(env, 0, (0.0, 1.5), 10, lambda count: None)

    found = taken("slammed-valves")
    assert np.isinf(found.errors[-1])
    assert found.scenes[-1].piston == found.scenes[-2].piston
    assert found.scenes[-1].time == pytest.approx(1.5)
    frames = animate.draw([found, taken("pid")], RIG, "lost", ["slam", "pid"], (0.0, 1.5), 10, lambda count: None)
    assert len(frames) == 16


def test_the_residual_is_the_policy_of_the_environment(tmp_path, monkeypatch, capsys):
    """Not the default of the controller, which has learned another scenario."""
    asked = []

    def spied(name, rig, **options):
        asked.append((name, options))
        return make_controller(name, rig, **options)

    monkeypatch.setattr(recorded, "make_controller", spied)
    path = tmp_path / "pull.webp"
    options = ("--controller", "pid", "residual", "--begin", 0.0, "--end", 1.0, "--rate", 10, "--out", path)
    assert call("animate", monkeypatch, capsys, *options)[0] == 0
    assert asked == [("pid", {}), ("residual", {"policy": "forceps"})]


def test_both_halves_have_one_scale_and_their_own_error(pair):
    times = np.array([0.0, 0.5, 1.0])
    same = pair.frame((SHOWN, SHOWN), times, 2 * (np.array([0.0, 0.005, 0.003]),))
    left, right = same[70:595, :478], same[70:595, 482:960]
    assert np.abs(left[:, 2:476].astype(int) - right[:, :474]).mean() < 1.0
    other = pair.frame((SHOWN, SHOWN), times, (np.array([0.0, 0.005, 0.003]), np.array([0.0, 0.001, 0.009])))
    assert (other[:, :480] == same[:, :480]).all()
    assert (other[:, 480:] != same[:, 480:]).any()


@pytest.mark.parametrize(
    "values", [{"piston": (np.nan, 0.0)}, {"user_force": (np.nan, 0.0)}, {"compliant_target": (np.inf, 0)}]
)
def test_what_is_not_finite_is_left_out(values, pair):
    assert pair.frame(
        (replace(SHOWN, **values), SHOWN), np.array([0.0, 1.0]), (np.array([0.0, np.inf]), np.array([np.nan, 0.1]))
    ).any()
