"""A control period of the plant in plain Python, and its derivatives: what ``test_step`` runs with another step.

Printed: what the textbook and the plant have for the state, and central differences of the plant beside tangent and adjoint.
"""

import json
import sys

import numpy as np

from birthsim_env.gradients.plant import Derivatives, jvp, vjp
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.lanes import STATES, Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.gradients.states import SCALES

PERIOD = 1e-3
COMMAND, PUSH = np.array([[0.3], [-0.2], [-0.4], [0.1]]), np.array([[[20.0], [-30.0]]])


def moving(law: str) -> Plant:
    """A rig in motion, away from every kink."""
    plant = Plant(Parameters().replace({"friction.law": law}))
    plant.state[[1, 3, 4, 5], 0] = 0.12, -0.2, 1.1e-4, -2e-4
    plant.state[14:, 0] = 0.2, -0.3, -0.2, 0.25
    return plant


def reached(law: str, along: Array, size: float) -> Array:
    """The state after a period that begins ``size`` farther ``along`` state, openings and force."""
    plant = moving(law)
    plant.state[:] += size * along[:STATES]
    command, push = COMMAND + size * along[STATES : STATES + 4], PUSH + size * along[STATES + 4 :]
    plant.advance_unchecked(command, push, PERIOD)
    return plant.state.copy()


def ralstons(law: str) -> Array:
    """A period in three steps by the textbook."""
    plant, step = moving(law), PERIOD / 3
    x = plant.state.copy()
    for _ in range(3):
        k1 = plant.derivatives(x, COMMAND, PUSH[0])
        k2 = plant.derivatives(x + step / 2 * k1, COMMAND, PUSH[0])
        k3 = plant.derivatives(x + 3 * step / 4 * k2, COMMAND, PUSH[0])
        x += step / 9 * (2 * k1 + 3 * k2 + 4 * k3)
    return x


def found(law: str) -> dict[str, list[float]]:
    """What is printed of a friction law, in units of the states."""
    rng = np.random.default_rng(0)
    along = np.concatenate(
        [SCALES * rng.standard_normal((STATES, 1)), 0.1 * rng.standard_normal((4, 1)), rng.normal(size=(2, 1))]
    )
    weight = rng.standard_normal((STATES, 1)) / SCALES
    way = Derivatives(along[:STATES], along[STATES : STATES + 4], along[None, STATES + 4 :], np.zeros((0, 1)))
    plant = moving(law)
    way = Derivatives(way.state, way.opening, way.force, np.zeros_like(plant.lane_parameters))
    forward = jvp(plant, COMMAND, PUSH, PERIOD, way)
    back = vjp(moving(law), COMMAND, PUSH, PERIOD)(weight)
    parts = ((back.state, way.state), (back.opening, way.opening), (back.force, way.force))
    size = 1e-5
    difference = (reached(law, along, size) - reached(law, along, -size)) / (2 * size)
    return {
        "plant": (reached(law, along, 0.0) / SCALES).ravel().tolist(),
        "textbook": (ralstons(law) / SCALES).ravel().tolist(),
        "difference": (difference / SCALES).ravel().tolist(),
        "tangent": (forward / SCALES).ravel().tolist(),
        "adjoint": [float(sum((a * b).sum() for a, b in parts)), float((weight * forward).sum())],
        "steps": [float(dynamics.steps_in(PERIOD))],
    }


if __name__ == "__main__":
    json.dump({law: found(law) for law in sys.argv[1:]}, sys.stdout)
