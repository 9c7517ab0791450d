"""What ``test_debug`` runs twice, compiled and as plain Python: prints one line of hashes, and which frames a trace met."""

import hashlib
import json
import sys

import gymnasium
import numpy as np

import agents  # noqa: F401  registers the residual environments
import birthsim_env
from baselines import evaluate, make_controller
from baselines.driving import driving
from birthsim_env.parts.hands.user_forces import UserForce

RIG = birthsim_env.Parameters()


def hashed(arrays):
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def steps(count, name, controller=None, lanes=None, **arguments):
    """States, signals, observations and rewards of policy steps from two episodes."""
    if controller:
        arguments["actuation"] = driving(make_controller(controller, RIG), controller)
    made = gymnasium.make(name, **arguments) if lanes is None else gymnasium.make_vec(name, num_envs=lanes, **arguments)
    env, rng = made.unwrapped, np.random.default_rng(0)
    found = []
    for seed in (3, 4):
        observation, _ = env.reset(seed=seed)
        found.append(observation)
        for _ in range(count):
            observation, reward, *_ = env.step(rng.uniform(-0.2, 0.2, env.action_space.shape).astype(np.float32))
            found += [observation, reward, env.simulation.plant.state.copy(), env.simulation.seen.copy()]
    return hashed(found)


def measured(name, controller, **arguments):
    """Metrics, returns and errors of an evaluation."""
    one = evaluate(name, make_controller(controller, RIG), controller, 1, 0, progress=False, **arguments)
    return hashed([one.traces[0], *one.metrics.values(), *one.returns.values()])


class Spring(UserForce):
    """A user's hand in Python."""

    closed_loop = True

    def force(self, time, position, velocity):
        return -100.0 * (position - 0.5)


OPTIONS = {
    "air.supply_conductance": 1e-8, "mechanics.mode_frequency": 20.0, "chambers.tube_length": 1.0, "valves.hysteresis": 0.02,
    "electronics.acceleration_bandwidth": 50.0,
}  # fmt: skip
CASES = {
    "circle lab backstepping": lambda: steps(3, "BirthSIM/Circle-v2", "backstepping", sensors="lab", randomize="plant"),
    "circle honest admittance": lambda: steps(3, "BirthSIM/Circle-v2", "admittance", sensors="honest", randomize="plant"),
    "probe honest backstepping": lambda: steps(3, "BirthSIM/Probe-v3", "backstepping", sensors="honest"),
    "probe lab admittance": lambda: steps(3, "BirthSIM/Probe-v3", "admittance", sensors="lab"),
    "evaluated": lambda: measured("BirthSIM/Circle-v2", "admittance", sensors="honest", randomize="plant", duration=0.05),
    "residual": lambda: steps(2, "BirthSIM/CircleResidual-v2", sensors="honest"),
    "options": lambda: steps(2, "BirthSIM/Forceps-v2", sensors="lab", parameters=RIG.replace(OPTIONS)),
    "lanes, a hand in Python": lambda: steps(2, "BirthSIM/Probe-v3", lanes=3, randomize="plant", user_force=Spring()),
}


def traced(kernel):
    """File, line and a local number of every frame of a ``kernel`` that Python enters in one control period."""
    env, met = gymnasium.make("BirthSIM/Circle-v2", policy_period=0.001).unwrapped, []
    env.reset(seed=0)

    def note(frame, event, argument):
        if event == "call" and frame.f_code.co_name == kernel:
            met.append([frame.f_code.co_filename, frame.f_code.co_firstlineno, frame.f_locals["n"]])

    sys.settrace(note)
    env.step(np.zeros(4, np.float32))
    sys.settrace(None)
    return met


if __name__ == "__main__":
    print(json.dumps({**{name: case() for name, case in CASES.items()}, "met": traced("_plant")}))
