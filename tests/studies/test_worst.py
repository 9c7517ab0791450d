"""``studies.honest.worst``: the worst drawn worlds, and what one of them owes to each of its figures."""

import gymnasium
import numpy as np
import pytest

from baselines.bench.evaluation import evaluate
from baselines.registry import make_controller
from birthsim_env.physics.rig.parameters import Parameters
from studies.honest import worst

SEED = 300


@pytest.mark.slow
def test_the_worst_world_is_that_of_the_evaluation_and_no_figure_changes_it_where_it_is_put_to_itself():
    found = worst.worst(
        "admittance-adaptive", "ideal", Parameters().to_dict(), "stiffness_error", limit=15.0, rest=3.0, worlds=1, episodes=3,
        seed=SEED,
    )  # fmt: skip
    law = make_controller("admittance-adaptive", Parameters())
    done = evaluate("BirthSIM/Probe-v2", law, "law", 3, SEED, False, randomize=True)
    sizes = np.abs(done.metrics["stiffness_error"])
    (world,) = found["worlds"]
    assert found["named"][0][0] == world["seed"] == SEED + int(np.argmax(sizes))
    assert world["size"] == pytest.approx(sizes.max(), rel=1e-9)
    figures = {row[0] for row in world["changes"]}
    assert "s of rest" in figures
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
