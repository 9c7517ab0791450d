"""SHA-256 of closed-loop trajectories, which must be equal on every processor; ``make golden`` stores them anew.

A run is a few drawn worlds of a scenario under openings given beforehand, under a controller at its 1 kHz, or under a
residual policy that comes with the package. Hashed are states, observations and rewards of every step.
"""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from agents.policy.files import read_policy
from agents.policy.seeds import best_policy
from baselines.named import controlling_names, make_controller
from birthsim_env import Parameters
from birthsim_env.parts.scenarios import environment_id, studied_scenarios
from birthsim_env.registry import names

FILE = Path(__file__).parent / "fingerprints.json"
LANES, SEED = 3, 7
PERIODS, STEPS = 800, 80



def rows() -> dict[str, tuple[str, str, str]]:
    """Name -> (scenario, sensors, who drives: "openings", "residual" or a controller)."""
    chosen = [("circle", "lab", name) for name in controlling_names()]
    for scenario in studied_scenarios():
        driven = ("openings", "backstepping", *(["residual"] if scenario in names("policy") else []))
        chosen += [(scenario, "ideal", who) for who in driven]
        chosen += [(scenario, "lab", "admittance-backstepping")]
    return {f"{scenario}, {sensors}, {who}": (scenario, sensors, who) for scenario, sensors, who in dict.fromkeys(chosen)}


def fingerprint(scenario: str, sensors: str, who: str, device: str = "cpu") -> str:
    """SHA-256 of one run."""
    digest = hashlib.sha256()
    for arrays in _run(scenario, sensors, who, device):
        for array in arrays:
            digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _here(array: Any) -> Any:
    """An array of NumPy's, also of one that CuPy has on a GPU."""
    return array.get() if hasattr(array, "get") else array


def _run(scenario: str, sensors: str, who: str, device: str) -> Iterator[tuple[Any, ...]]:
    shared = {"num_envs": LANES, "sensors": sensors, "randomize": True, "device": device}
    if who == "residual":
        policy = read_policy(best_policy(scenario))
        act = policy.network.acting()
        env: Any = gymnasium.make_vec(policy.environment, **shared, **policy.settings.to_dict())
    else:
        period = 0.01 if who == "openings" else Parameters().electronics.control_period
        env = gymnasium.make_vec(environment_id(scenario), **shared, policy_period=period)
    controller = None if who in ("openings", "residual") else make_controller(who, Parameters())
    rng = np.random.default_rng(SEED)
    observation = _here(env.reset(seed=SEED)[0])
    for _ in range(PERIODS if controller else STEPS):
        if controller:
            action = controller.command(env.measurement, env.reference).T
        else:
            action = act(observation) if who == "residual" else rng.uniform(-0.4, 0.4, (LANES, 4))
        observation, reward, terminated = map(_here, env.step(action)[:3])
        if controller and terminated.any():
            controller.reset(terminated)
        yield _here(env.plant_state), observation, reward
    env.close()


if __name__ == "__main__":
    made = {name: fingerprint(*row) for name, row in rows().items()}
    FILE.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")
    print(f"written: {FILE}")
