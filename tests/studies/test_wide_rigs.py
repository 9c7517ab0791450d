"""The study of rigs that nobody described: who is told a rig is told that of its world, and a row that is told is better."""

from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
import pytest

from baselines.bench.pieces import controller_settings
from baselines.estimation.rig_filter import TOLD
from birthsim_env.physics.compiled.lanes import parameter_array
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.comparison.privileged import drawn_rigs
from lab.studies.honest import wide_rigs

SEED, LANES = 7_000, 8


def test_the_rigs_that_are_told_are_those_of_the_worlds():
    env: Any = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=LANES, randomize=TOLD)
    with closing(env):
        env.reset(seed=[SEED + k for k in range(LANES)])
        drawn = env.unwrapped.simulation.plant.lane_parameters
        np.testing.assert_array_equal(drawn, parameter_array(drawn_rigs(Parameters(), TOLD, range(SEED, SEED + LANES)), LANES))


def test_wider_ranges_hold_the_expected_ones():
    for name, (low, high) in TOLD.items():
        least, most = wide_rigs.RANGES["beyond"][name]
        assert most > high
        # A larger piston needs more dead volume.
        assert least < low or name == "chambers.dead_volume"


def sizes(found: Any, metric: str) -> list[float]:
    return [np.inf if one == "lost" else one for one in found[metric]]


@pytest.mark.slow
def test_who_is_told_its_rig_follows_more_exactly():
    errors = {}
    for name, told in (("admittance-adaptive", False), (wide_rigs.KNOWS, True)):
        settings = controller_settings(name, Parameters())
        errors[told] = sizes(
            wide_rigs.measure("circle", told=told, ranges="expected", episodes=LANES, seed=SEED, **settings), "settled_rms"
        )
    assert len(errors[False]) == len(errors[True]) >= 2, "the same worlds"
    assert np.mean(errors[True]) < np.mean(errors[False])


@pytest.mark.slow
def test_who_finds_its_rig_brings_a_fallen_head_back_before_it_rests():
    """Nine of ten heads are as calm from 1 s on as those of a controller that leaves its heads where they fell."""
    worst = {}
    for name in ("admittance-adaptive", "admittance-adaptive[finds_rig=true]"):
        settings = controller_settings(name, Parameters())
        found: Any = wide_rigs.measure("probe", told=False, ranges="expected", episodes=64, seed=SEED, **settings)
        worst[name] = {metric: np.quantile(sizes(found, metric), 0.9) for metric in ("settled_rms", "hunting")}
    leaves, finds = worst.values()
    assert finds["settled_rms"] < 0.5 * leaves["settled_rms"]
    assert finds["hunting"] < leaves["hunting"]
