"""What a user adds, each in a file of ``plugins``: a controller, a sensor model, a scenario, a hand.

Each is used by ``gymnasium.make`` and by evaluation, and acts.
"""

import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from baselines import evaluate, make_controller
from baselines.driving import driving
from birthsim_env import Parameters, registry

KINDS = ("scenario", "sensors")
PLUGINS = Path(__file__).parent / "plugins"
PROBE = "BirthSIM/Probe-v3"
RIG = Parameters()


@pytest.fixture(autouse=True)
def imports(monkeypatch):
    """Plugins are imported by their names, as a user's are; what they register is gone after a test."""
    assert all(registry.names(kind) for kind in KINDS), "all of the package's own are there"
    tables = *(registry._ENTRIES[kind] for kind in KINDS), gymnasium.registry
    kept = [dict(table) for table in tables]
    monkeypatch.syspath_prepend(PLUGINS)
    yield
    for table, before in zip(tables, kept, strict=True):
        table.clear()
        table.update(before)
    for name in ("sensor", "scenario"):
        sys.modules.pop(name, None)


def evaluated(controller, environment=PROBE, episodes=3, **arguments):
    return evaluate(environment, make_controller(controller, RIG), controller, episodes, 0, progress=False, **arguments)


def test_a_controller_in_python_and_compiled_is_the_same_to_the_bit_and_follows():
    names = (f"{PLUGINS}/controller.py:Plain", f"{PLUGINS}/controller.py:Compiled", "shut-valves")
    plain, compiled, shut = (evaluated(name, "BirthSIM/Circle-v2", duration=2.0) for name in names)
    np.testing.assert_array_equal(plain.traces[0], compiled.traces[0])
    assert max(plain.metrics["error_rms_x"]) < 0.2 * min(shut.metrics["error_rms_x"])
    assert not list(PLUGINS.glob("*.nbc")), "machine code is kept in its own folder, not beside a user's file"


def test_a_controller_drives_an_environment():
    law = make_controller(f"{PLUGINS}/controller.py:Compiled", RIG)
    env = gymnasium.make("BirthSIM/Circle-v2", actuation=driving(law, None), policy_period=0.001).unwrapped
    env.reset(seed=0)
    for _ in range(200):
        wanted, seen = env.reference.position, env.measurement.position
        along, up = np.clip(10.0 * (wanted - seen), -1, 1)
        env.step(np.zeros(0, np.float32))
        np.testing.assert_array_equal(env.simulation.openings[:, 0], (-up, up, along, -along))
    assert len(env.simulation._loop._pieces) == 1, "all of it is compiled"


def test_a_sensor_model_shows_the_steps_of_its_own():
    import sensor  # noqa: F401  # registers it

    env = gymnasium.make("BirthSIM/Circle-v2", sensors="coarse").unwrapped
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.zeros(4, np.float32))
        seen, true = env.measurement.position, env.simulation.motion[:2, 0]
        np.testing.assert_allclose(seen, np.round(true, 3), atol=1e-12)
        assert np.abs(seen - true).max() <= 0.5001e-3
    assert len(env.simulation._loop._pieces) == 1, "all of it is compiled"
    coarse, ideal = (evaluated("admittance", sensors=sensors) for sensors in ("coarse", "ideal"))
    assert min(coarse.metrics["settled_rms"]) > 1.2 * max(ideal.metrics["settled_rms"])


def test_a_scenario_has_an_id():
    env = gymnasium.make("scenario:BirthSIM/Stroll-v0")
    assert "BirthSIM/StrollResidual-v0" in gymnasium.registry
    _, info = env.reset(seed=0)
    assert info["target"][0] == pytest.approx(0.48)
    for _ in range(220):
        _, _, _, _, info = env.step(np.zeros(4, np.float32))
    assert info["target"][0] == pytest.approx(0.52)
    assert len(env.unwrapped.simulation._loop._pieces) == 1, "all of it is compiled"
    result = evaluated("backstepping", "BirthSIM/Stroll-v0")
    assert result.lost == [False] * 3
    assert len(result.traces[0]) == 300, "s of the scenario, at 100 Hz"
    assert max(result.metrics["error_max_x"]) < 5.0


def test_a_hand_pulls_in_each_episode_with_a_stiffness_of_its_own():
    hand = f"{PLUGINS}/hand.py:Spring"
    env = gymnasium.make_vec(PROBE, num_envs=3, user_force=hand)
    _, info = env.reset(seed=0)
    stiffness = info["user_force"][:, 0] / (0.52 - info["position"][:, 0])
    assert np.ptp(stiffness) > 100.0
    for _ in range(20):
        _, _, _, _, info = env.step(np.zeros((3, 4)))
        np.testing.assert_allclose(info["user_force"][:, 0], stiffness * (0.52 - info["position"][:, 0]))
    first = evaluated("backstepping", user_force=hand, duration=1.0).traces[0][0]
    np.testing.assert_allclose(first[:, 0], -stiffness * 0.02 / 2000.0)  # the asked-for spring has 2000 N/m
