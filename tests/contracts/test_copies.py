"""A controller that is copied or pickled in the middle of an episode goes on with the same bits."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest

from agents.policy.shipped import loadable_for
from baselines.named import make_controller
from birthsim_env import Parameters
from birthsim_env.registry import names

RIG = Parameters()
NAMES = [
    *names("controller", listed=True),
    "limited:admittance-adaptive",
    "limited:residual:circle_lab_apg",
    *(f"residual:{one}" for one in loadable_for(RIG)),
]
COPIES = {"copy": copy.deepcopy, "pickle": lambda law: pickle.loads(pickle.dumps(law))}


@pytest.mark.parametrize("name", NAMES)
def test_a_copy_goes_on_as_the_original_does(name):
    """Sampled positions, so that observers and policies remember. One lane of both begins anew later on."""
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2, sensors="lab", randomize=True, policy_period=0.001)
    env.reset(seed=3)
    law, copies = make_controller(name, RIG), {}
    for tick in range(75):
        if tick == 25:
            copies = {kind: make(law) for kind, make in COPIES.items()}
        if tick == 50:
            for one in (law, *copies.values()):
                one.reset(np.array([False, True]))
        openings = np.array(law.command(env.measurement, env.reference))
        for kind, one in copies.items():
            np.testing.assert_array_equal(one.command(env.measurement, env.reference), openings, err_msg=f"{kind}, {tick}")
        env.step(openings.T)
    env.close()
