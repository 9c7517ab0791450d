"""``lab.studies.honest.worst``: the worst worlds, drawn and found, and what the found one owes to each of its figures."""

import gymnasium
import numpy as np
import pytest

from baselines.bench.evaluation import evaluate
from baselines.named import make_controller
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.physics.compiled.lanes import MASS, parameter_column
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.honest import search, worst

SEED = 300
RIG = Parameters()
RANGES = documented_ranges(RIG)


@pytest.mark.slow
def test_the_found_world_is_worse_than_all_drawn_ones_and_comes_again_in_every_bit():
    found = worst.worst("admittance-adaptive", "ideal", RIG.to_dict(), "stiffness_error", 15.0, 3.0, episodes=32, seed=SEED)
    law = make_controller("admittance-adaptive", RIG)
    done = evaluate("BirthSIM/Probe-v3", law, "law", 32, SEED, False, randomize=True)
    sizes = np.abs(done.metrics["stiffness_error"])
    assert found["named"][0] == [SEED + int(np.argmax(sizes)), done.metrics["stiffness_error"][int(np.argmax(sizes))]]
    world = found["found"]
    assert world["size"] > sizes.max()
    assert world["strength"] <= 1.0
    fixed = {name: [value, value] for name, value in world["figures"].items()}
    rig = Parameters.from_dict({**RIG.to_dict(), "randomize": fixed})
    again = evaluate("BirthSIM/Probe-v3", law, "law", 1, world["seed"], False, randomize=True, parameters=rig)
    assert np.abs(again.metrics["stiffness_error"]) == [world["size"]]
    figures = {row[0] for row in world["changes"]}
    assert "s of rest" in figures
    assert not any(name.startswith("electronics.") for name in figures), "ideal sensors have none"


def test_places_are_figures_as_the_environment_draws_them():
    seeds = np.arange(SEED, SEED + 3)
    rigs = search.rigs_at(search.drawn_places(seeds, RANGES), RANGES, RIG)
    drawn = [parameter_column(draw_parameters(RIG, RANGES, stream(int(seed), 0, "parameters"))) for seed in seeds]
    np.testing.assert_array_equal(rigs, np.stack(drawn, axis=1))


def test_a_search_finds_the_corner_in_which_a_size_is_largest():
    """Of a sum of distances from one corner, in the seed that counts double."""
    corner = np.array([0.0, 1.0, 1.0])

    def judge(seeds, places):
        return (1.0 + (seeds == 7)) * (1.0 - np.abs(places - corner[:, None])).sum(axis=0)

    seeds, places = np.array([6, 7, 8]), np.full((3, 3), 0.5)
    seed, place = search.hardest(judge, seeds, places, judge(seeds, places), 800, 0)
    assert seed == 7
    np.testing.assert_allclose(place, corner, atol=0.02)


def test_a_world_is_told_as_the_environment_draws_it():
    env = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=1, randomize=True, sensors="honest", policy_period=0.5)
    env.reset(seed=[SEED])
    mass = env.simulation.plant.lane_parameters[MASS, 0]
    noise = env.simulation.sensors.parameters["position_noise"][0]
    for _ in range(9):
        info = env.step(np.zeros((1, 4), dtype=np.float32))[4]
        info = info.get("final_info", info)
    figures, push, way = worst._world(RIG, "honest", SEED)
    env.close()
    assert figures["mechanics.mass"] == mass
    assert figures["electronics.position_noise"] == noise
    assert push == pytest.approx(np.hypot(*info["user_force"][0]))
    stiffness = info["stiffness_setpoint"][0][np.argmax(np.abs(info["user_force"][0]))]
    assert way == pytest.approx(1e3 * push / stiffness), "axes' pushes"


def test_another_rest_meets_the_same_worlds():
    declared, short = (worst._evaluated("admittance-adaptive", rest, RIG, "ideal", [SEED, SEED + 1]) for rest in (3.0, 1.0))
    assert short.required_strength_ratio == pytest.approx(declared.required_strength_ratio, rel=0.05)
    assert short.seeds == declared.seeds
    assert np.isfinite(short.metrics["stiffness_error"]).all()
