"""Rigs that were accepted run; and rigs far from the default one."""

import gymnasium
import numpy as np

STEPS = 12


def run_a_little(rig, steps=STEPS, **arguments):
    """Some steps under random openings: while an episode goes on, nothing is anything but finite."""
    period = rig.electronics.control_period
    arguments = {"policy_period": period * max(1, round(0.01 / period)), **arguments}
    env = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=2, parameters=rig, **arguments)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(steps):
        observation, reward, terminated, *_ = env.step(rng.uniform(-1, 1, (2, 4)))
        assert np.isfinite(observation).all()
        assert np.isfinite(reward).all()
        assert np.isfinite(env.unwrapped.simulation.plant.state[:, ~terminated]).all()
        if terminated.any():
            break


def odd_rig(seed):
    """Tables of a TOML file: bores of 16 to 63 mm, strokes of 50 to 600 mm, masses of 0.5 to 20 kg, the rest in proportion."""
    rng = np.random.default_rng(seed)
    tables = {"mechanics": {"mass": float(np.exp(rng.uniform(np.log(0.5), np.log(20))))}}
    bores = np.exp(rng.uniform(np.log(0.016), np.log(0.063), 2))
    for k, bore in enumerate(bores, start=1):
        tables[f"cylinder{k}"] = {
            "piston_diameter": float(bore),
            "rod_diameter": 0.4 * float(bore),
            "stroke": float(rng.uniform(0.05, 0.6)),
            "coulomb_friction": 12.0 * float(bore / 0.025) ** 2,
        }
    tables["valves"] = {"sonic_conductance": min(2e-8, 3.9e-9 * float(bores.max() / 0.025) ** 2)}
    return tables
