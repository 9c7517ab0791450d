"""Residuals on a rail: an entry for each pair of two cylinders, of the force, of the stiffness and of what is known besides."""

import math

import gymnasium
import numpy as np
import pytest

from agents.residual import features
from agents.residual.corrected import STIFFENING, CorrectedController, action_names
from agents.residual.settings import IMPEDANCES, ResidualSettings
from birthsim_env import Parameters
from birthsim_env.loop.signals import Measurement
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant
from tests.oracles import closed_loop
from tests.residual.test_residual_env import assert_follows, by_hand, single

NAME, TILT = "BirthSIM/RailResidual-v0", 0.5
RIG = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": TILT})
SIZES = {"fixed": 1, "variable_kp": 2, "variable": 3}


def test_an_action_has_an_entry_for_each_pair_and_says_which() -> None:
    assert SIZES.keys() == IMPEDANCES.keys()
    for impedance, size in SIZES.items():
        env = single(NAME, impedance=impedance)
        assert env.action_space.shape == (size,)
        names = action_names(ResidualSettings(impedance=impedance), RIG)
        assert [name.partition(",")[0] for name in names] == [
            "believed force on cylinder 2", "stiffness Kcl", "damping",
        ][:size]  # fmt: skip
    plain, told = (single(NAME, informed=one).observation_names for one in (False, True))
    assert told[: len(plain)] == plain
    assert [name for name in told[len(plain) :] if "along the rail" in name or "piston 2" in name] == list(told[len(plain) :])
    assert len(told) - len(plain) == features.EstimatorFeatures.size // 2


@pytest.mark.parametrize("law", ["backstepping", "backstepping-frozen"])
@pytest.mark.parametrize("sensors", ["ideal", "encoders"])
def test_zero_actions_are_bit_for_bit_the_law(law: str, sensors: str) -> None:
    arguments = {"sensors": sensors, "randomize": True, "parameters": RIG}
    rows = by_hand(NAME, 140, 3, law=law, **arguments)
    for size, more in [*((size, {"impedance": one}) for one, size in SIZES.items()), (1, {"informed": True})]:
        env = single(NAME, law=law, **more, **arguments)
        assert_follows(env, np.zeros((140, size), np.float32), rows, seed=3)


def test_what_is_known_does_not_depend_on_the_direction_of_the_rail() -> None:
    """Without weight a rail may be turned: the same actions make the same entries."""
    seen = []
    for tilt in (0.0, TILT, math.pi / 2):
        rig = RIG.replace({"linkage.inclination": tilt, "mechanics.gravity": 0.0})
        env = gymnasium.make(NAME, parameters=rig, impedance="variable", informed=True)
        env.reset(seed=1)
        actions = np.random.default_rng(2).uniform(-1, 1, (150, 3)).astype(np.float32)
        seen.append([env.step(action)[0] for action in actions])
    level, *others = np.array(seen, dtype=np.float64)
    assert np.ptp(level[:, -features.EstimatorFeatures.size // 2 :], axis=0).min() > 0.01
    for other in others:
        np.testing.assert_allclose(other, level, atol=2e-5)  # observations are of single precision


POWERS = np.array([[0.5, 0.0, 0.25, -0.5]])


@pytest.mark.parametrize("sensed", [True, False])
def test_a_policy_sets_the_stiffness_that_an_unseen_force_meets(sensed: bool) -> None:
    """4 N along the rail at 2000 N/m: a hand that is measured feels that, whatever the power; an unseen force meets K 4^p."""
    rig = closed_loop.IDEAL.replace({"linkage.kind": "rail", "linkage.inclination": TILT})
    along = np.array([[math.cos(TILT)], [math.sin(TILT)]])
    lanes = POWERS.shape[1]
    wanted = closed_loop.holding(0.5 * np.repeat(along, lanes, axis=1), 2000.0)
    plant = closed_loop.resting_at(wanted, rig)
    law = CorrectedController(rig, ResidualSettings("backstepping-weight", "variable_kp"))
    law.reset(np.ones(lanes, dtype=np.bool_))
    law.accept(np.concatenate([np.zeros((1, lanes)), POWERS]))
    force = 4.0 * np.repeat(along, lanes, axis=1)

    def sense(plant: Plant, time: float, force: Array) -> Measurement:
        return closed_loop.ideal(plant, time, force if sensed else np.zeros_like(force))

    for _ in closed_loop.run(plant, law.command, lambda t: wanted, lambda t: force * min(t / 0.5, 1.0), 2.5, sense):
        pass
    moved = along.T @ (plant.end_effector()[:2] - wanted.position)
    stiffness = 2000.0 if sensed else 2000.0 * STIFFENING ** np.maximum(POWERS, 0.0)
    np.testing.assert_allclose(moved, np.broadcast_to(4.0 / stiffness, (1, lanes)), rtol=0.01)
