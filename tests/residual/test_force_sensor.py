"""Without a force sensor nothing inside reads the hand's force: neither the observation, nor an observer, nor the law."""

import gymnasium
import numpy as np
import pytest

from agents.residual.settings import LAWS, NO_LAW, ResidualSettings, needs_force
from birthsim_env.parts.sensors.honest import HonestSensors
from tests.registered import registered

CIRCLE, LANES, STEPS = "BirthSIM/CircleResidual-v2", 3, 140
BLIND = [law for law in LAWS if not needs_force(law)]


def course(law, actions, **arguments):
    """Observations and states of a run."""
    env = gymnasium.make_vec(CIRCLE, num_envs=LANES, randomize=True, law=law, **arguments)
    found = [env.reset(seed=3)[0]]
    for action in actions:
        observation, _, _, _, info = env.step(action)
        found += [observation, env.simulation.plant.state.copy(), env.simulation.openings]
    assert np.abs(info["user_force"]).max() > 5, "it was pushed"
    return found


def actions_for(law, reach=0.3):
    size = ResidualSettings(law).size
    reach = 0.02 if law == NO_LAW else reach
    return np.random.default_rng(0).uniform(-reach, reach, (STEPS, LANES, size)).astype(np.float32)


class Lying(HonestSensors):
    """Honest sensors whose force sensor shows something else altogether."""

    def measure(self, *seen):
        told = super().measure(*seen)
        told.user_force[:] = 1000.0
        return told


@pytest.mark.parametrize("law", BLIND)
def test_what_a_force_sensor_would_show_changes_no_bit(law, monkeypatch):
    registered(monkeypatch, Lying, sensors="lying")
    blind = [course(law, actions_for(law), sensors=kind, force_sensor=False) for kind in ("honest", "lying")]
    for one, other in zip(*blind, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_force_that_is_shown_is_zero_from_the_first_observation_on():
    env = gymnasium.make("BirthSIM/Circle-v2", sensors="lab", force_sensor=False).unwrapped
    observation, _ = env.reset(seed=0)
    felt = [k for k, name in enumerate(env.observation_names) if name.startswith("user force")]
    assert len(felt) == 2
    for _ in range(STEPS):
        assert not env.measurement.user_force.any()
        assert not observation[felt].any()
        observation, *_, info = env.step(np.zeros(4))
    assert np.abs(info["user_force"]).max() > 5
