"""Makes the stored trajectories that pin the physics: ``make golden``, after a change that is meant to move them.

plant_lugre, plant_coulomb   the plant alone under seeded openings and forces, its state every 20 ms for 0.6 s
circle                       the law on the Circle, end effector and pressures every 20 ms for 3 s
"""

import hashlib
import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from baselines import BacksteppingController
from birthsim_env import Parameters, Plant

FILE = Path(__file__).parent / "trajectories.npz"


def fingerprint() -> str:
    """Hash of the default rig: trajectories stored for another one are stale."""
    return hashlib.sha256(json.dumps(Parameters().to_dict(), sort_keys=True).encode()).hexdigest()


def plant_run(law: str) -> np.ndarray[Any, Any]:
    plant = Plant(Parameters().replace({"friction.law": law}), num_envs=2)
    rng = np.random.default_rng(7)
    states = [plant.state.copy()]
    for _ in range(30):
        plant.advance(rng.uniform(-0.4, 0.4, (4, 2)), rng.uniform(-30, 30, (2, 2)), 0.02)
        states.append(plant.state.copy())
    return np.stack(states)


def circle_run() -> np.ndarray[Any, Any]:
    env = gymnasium.make("BirthSIM/Circle-v1", policy_period=0.001)
    rig: Any = env.unwrapped
    env.reset(seed=0)
    law = BacksteppingController()
    rows = []
    for step in range(3001):
        if step % 20 == 0:
            rows.append(np.concatenate([rig.measurement.position, rig.measurement.pressures]))
        env.step(law.command(rig.measurement, rig.reference))
    return np.stack(rows)


def trajectories() -> dict[str, np.ndarray[Any, Any]]:
    return {"plant_lugre": plant_run("lugre"), "plant_coulomb": plant_run("coulomb"), "circle": circle_run()}


if __name__ == "__main__":
    np.savez_compressed(FILE, fingerprint=np.array(fingerprint()), **trajectories())
    print(f"written: {FILE}")
