"""Setpoints at which the backstepping laws would swing are refused by name."""

import gymnasium
import numpy as np
import pytest

from baselines.backstepping.stiffest import stiffest, stiffest_direction
from baselines.named import make_controller
from birthsim_env import Parameters
from lab.studies.haptics.worlds import POSES, no_hand, resting
from lab.studies.stability.rig_port import RigPort
from lab.studies.stability.swinging import ASKED, rests_up_to

LAWS = ("backstepping", "backstepping-cartesian")
LIGHT = Parameters().replace({"mechanics.mass": 1.6, "valves.time_constant": 0.008})


def test_the_bound_is_the_mass_over_the_lag():
    rig = Parameters().replace({"mechanics.mass": 6.0, "valves.time_constant": 0.003, "electronics.position_latency": 0.012})
    assert stiffest(rig, False) == pytest.approx(12.0 * 6.0 / 0.003)
    assert stiffest(rig, True) == pytest.approx(12.0 * 6.0 / 0.006)


@pytest.mark.parametrize(
    ("name", "sensors", "rig"),
    [
        ("backstepping", "lab", LIGHT),
        *(
            pytest.param(name, *case, marks=pytest.mark.slow)
            for name in LAWS
            for case in (("ideal", Parameters()), ("lab", Parameters()), ("lab", LIGHT))
            if (name, *case) != ("backstepping", "lab", LIGHT)
        ),
    ],
)
def test_the_laws_rest_below_the_bound_and_swing_not_far_above(name, sensors, rig):
    """ "Not far": the measured range of the rate, 12 to 34 1/s, and one step of the setpoints tried."""
    limit = rests_up_to(name, rig, sensors)
    assert ASKED[0] < stiffest(rig, sensors != "ideal") <= limit < stiffest(rig, sensors != "ideal") * 34 / 12 * 1.2


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("sensors", ["ideal", "lab", "honest"])
def test_stiffer_setpoints_are_refused_by_name(name, sensors):
    rig = Parameters()
    most = stiffest(rig, sensors != "ideal")
    RigPort([rig] * 2, resting([POSES[0]] * 2, [2000.0, 0.999 * most]), make_controller(name, rig), sensors).advance(no_hand)
    port = RigPort([rig] * 2, resting([POSES[0]] * 2, [2000.0, 1.001 * most]), make_controller(name, rig), sensors)
    with pytest.raises(ValueError, match=rf"reference.stiffness = .* in lane 1; allowed: at most {most:.0f} N/m"):
        port.advance(no_hand)


def test_what_counts_is_the_stiffest_direction():
    k = np.array([[5000.0, 3000.0], [3000.0, 7000.0]])
    assert stiffest_direction(5000.0, 7000.0, 3000.0) == pytest.approx(np.linalg.eigvalsh(k)[1], rel=1e-14)


def test_a_law_inside_an_environment_refuses_too():
    env = gymnasium.make("BirthSIM/CircleResidual-v2", parameters=LIGHT, sensors="lab")
    env.reset(seed=0)
    still = np.zeros(env.action_space.shape, dtype=np.float32)
    for _ in range(790):
        env.step(still)
    with pytest.raises(ValueError, match=r"reference.stiffness = .*; allowed: at most 2133 N/m"):
        # From 8 s on the circle asks for 4000 N/m.
        [env.step(still) for _ in range(20)]
