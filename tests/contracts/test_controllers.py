"""Every registered controller over lanes: one rig is a lane of many, a reset starts that lane alone, mixed shapes are named."""

from __future__ import annotations

import dataclasses

import gymnasium
import numpy as np
import pytest

from baselines.registry import LIMITED, SLOW, listed_names, make_controller
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import Parameters

RIG = Parameters()
FELT = RIG.replace({"electronics.acceleration_bandwidth": 300.0})
NAMES = [*listed_names(), *(LIMITED + name for name in ("backstepping", "admittance-adaptive"))]
CASES = [
    pytest.param(name, sensors, RIG, id=f"{name}-{sensors}", marks=[pytest.mark.slow] * (name in SLOW))
    for name in NAMES for sensors in SENSORS
]  # fmt: skip
CASES.append(pytest.param("admittance-adaptive", "honest", FELT, id="admittance-adaptive-acceleration"))
RANDOM = {"random-valves"}
"""Its openings are drawn from one stream for all lanes."""


def made(name, rig=RIG):
    if name in SLOW:
        pytest.importorskip("casadi", reason="pip install 'birthsim[mpc]'")
    return make_controller(name, rig)


def recorded(law, sensors, rig, ticks):
    """What a law of three lanes is handed in closed loop with randomised rigs, and what it commands."""
    env = gymnasium.make_vec(
        "BirthSIM/Circle-v1", num_envs=3, sensors=sensors, policy_period=0.001, randomize=True, parameters=rig
    )
    env.reset(seed=40)
    signals, commands = [], []
    for _ in range(ticks):
        signals.append((env.measurement, env.reference))
        commands.append(np.array(law.command(*signals[-1])))
        env.step(commands[-1].T)
    env.close()
    return signals, commands


def lane_of(signals, lane):
    """Signals of one rig, without a lane axis."""
    measured, wanted = signals
    fields = {name: value[..., lane] for name, value in vars(measured).items() if isinstance(value, np.ndarray)}
    return Measurement(**fields, sampled=measured.sampled), Reference(wanted.rows[:, lane])


@pytest.mark.parametrize(("name", "sensors", "rig"), CASES)
def test_one_rig_is_a_lane_of_many_and_a_reset_starts_it_alone(name, sensors, rig):
    ticks, fresh = 16 if name in SLOW else 60, np.array([False, True, False])
    kept, reset, single, late, again = (made(name, rig) for _ in range(5))
    signals, commands = recorded(kept, sensors, rig, ticks)
    for tick, (pair, expected) in enumerate(zip(signals, commands, strict=True)):
        if tick == ticks // 2:
            reset.reset(fresh)
        got = reset.command(*pair)
        assert got.shape == (4, 3)
        assert np.abs(got).max() <= 1.0
        if name in RANDOM:
            continue
        np.testing.assert_array_equal(got[:, ~fresh], expected[:, ~fresh])
        np.testing.assert_array_equal(single.command(*lane_of(pair, 1)), expected[:, 1])
        if tick >= ticks // 2:
            np.testing.assert_array_equal(got[:, 1], late.command(*lane_of(pair, 1)))
    reset.reset()
    np.testing.assert_array_equal(reset.command(*signals[0]), again.command(*signals[0]))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in NAMES if not name.endswith("-valves")]
)
def test_signals_over_different_lanes_are_refused(name):
    """A compiled loop would read past the shorter array without a word."""
    law = made(name)
    ((measured, wanted),), _ = recorded(law, "ideal", RIG, 1)
    law.reset()
    for field in ("velocity", "pressures", "user_force"):
        wrong = dataclasses.replace(measured, **{field: getattr(measured, field)[:, :1]})
        with pytest.raises(ValueError, match=rf"measurement.{field} has shape .* allowed: \(\d, 3\)"):
            law.command(wrong, wanted)
    for rows in (wanted.rows[:, :1], wanted.rows[:8]):
        with pytest.raises(ValueError, match=r"reference.rows has shape .* allowed: \(15, 3\)"):
            law.command(measured, Reference(rows.copy()))
