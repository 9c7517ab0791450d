"""``studies.honest.worst``: the worst drawn worlds, and what one of them owes to each of its figures."""

from __future__ import annotations

import sys

import gymnasium
import numpy as np
import pytest

from baselines.bench.evaluation import evaluate
from baselines.registry import make_controller
from birthsim_env.physics.rig.parameters import Parameters
from studies.honest import worst

SEED = 300


def rows_of(text):
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("|")]


@pytest.mark.slow
def test_the_worst_world_is_that_of_the_evaluation_and_no_figure_changes_it_where_it_is_put_to_itself(monkeypatch, capsys):
    command = ["worst", "--controller", "admittance-adaptive", "--sensors", "ideal", "--episodes", "3", "--seed", str(SEED)]
    monkeypatch.setattr(sys, "argv", command)
    worst.main()
    out = capsys.readouterr().out
    rows = rows_of(out)
    law = make_controller("admittance-adaptive", Parameters())
    done = evaluate("BirthSIM/Probe-v2", law, "law", 3, SEED, False, randomize=True)
    sizes = np.abs(done.metrics["stiffness_error"])
    first = SEED + int(np.argmax(sizes))
    assert rows[2][-1].startswith(f"{first} (")
    assert f"world {first}: stiffness_error {sizes.max():.3g} %" in out
    figures = {row[0] for row in rows[5:]}
    assert {"s of rest", "mechanics.mass"} <= figures
    assert not any(name.startswith("electronics.") for name in figures), "ideal sensors have none"


def test_a_world_is_told_as_the_environment_draws_it():
    env = gymnasium.make_vec("BirthSIM/Probe-v2", num_envs=1, randomize=True, sensors="honest", policy_period=4.5)
    env.reset(seed=[SEED])
    mass = env.simulation.plant.lane_parameters[8, 0]
    noise = env.simulation.sensors.figures["position_noise"][0]
    info = env.step(np.zeros((1, 4), dtype=np.float32))[4]
    figures, push, way = worst._world(Parameters(), "honest", SEED)
    env.close()
    assert figures["mechanics.mass"] == mass
    assert figures["electronics.position_noise"] == noise
    assert push == pytest.approx(np.hypot(*info["user_force"][0]))
    stiffness = info["stiffness_setpoint"][0][np.argmax(np.abs(info["user_force"][0]))]
    assert way == pytest.approx(1e3 * push / stiffness), "axes' pushes"


def test_another_rest_meets_the_same_worlds():
    declared, short = (worst._evaluated("admittance-adaptive", rest, Parameters(), "ideal", SEED, 2) for rest in (3.0, 1.0))
    assert short.required_strength_ratio == pytest.approx(declared.required_strength_ratio, rel=0.05)
    assert short.seeds == declared.seeds
    assert np.isfinite(short.metrics["stiffness_error"]).all()
