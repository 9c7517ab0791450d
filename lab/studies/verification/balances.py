"""Balances of the plant in figures: mass and energy of the chambers, mechanical energy of the pistons.

birthsim study verification balances
"""

from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import V1, V2, Y1, Y2, Array
from birthsim_env.physics.dynamics import INTEGRATION_STEP
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.verification.bookkeeper import GAMMA, Bookkeeper, P, Volumes

LANES, SECONDS = 6, 2.0
COLLIDING = 36
_PHYSICS = ("dynamics", "chambers", "valves", "mechanics", "friction", "geometry", "equilibrium", "lanes", "parameters")
SOURCES = (
    *("lab/studies/verification/balances.py", "lab/studies/verification/bookkeeper.py"),
    *(f"birthsim_env/physics/{name}.py" for name in _PHYSICS),
)
"""Files that decide these figures."""


def chambers(step: float, collide: bool) -> dict[str, float]:
    """Largest relative gap between books and chambers, for steps of ``step`` s.

    Valves and pushes at random; a hand's spring keeps six lanes clear of the stops for 2 s, or 36 run into them in 0.2 s.
    """
    rng, rig, lanes = np.random.default_rng(0), Parameters(), COLLIDING if collide else LANES
    keeper = Bookkeeper(rig, lanes, step)
    plant = keeper.plant
    if collide:
        outward = rng.choice([-1.0, 1.0], (2, lanes))
        plant.state[[Y1, Y2]], plant.state[[V1, V2]] = outward * [[0.08], [0.17]], 0.6 * outward
        keeper = Bookkeeper(rig, lanes, step, plant.state)
    centre, worst, depth = plant.end_effector()[:2].copy(), np.zeros(2), np.zeros((2, lanes))
    for k in range(round((0.2 if collide else SECONDS) / 0.02)):
        if k % 10 == 0:
            command = rng.uniform(-1, 1, (4, lanes)) * np.linspace(0.1, 1, lanes) * (k % 30 > 0)
            push = rng.uniform(-100, 100, (2, lanes))
        motion = keeper.plant.end_effector()
        spring = -2000 * (motion[:2] - centre) - 60 * motion[2:]
        keeper.advance(command, push + (0.0 if collide else spring), 0.02)
        worst, depth = np.maximum(worst, keeper.gap()), np.maximum(depth, np.abs(keeper.plant.piston))
    met = int((depth > [[0.1], [0.2]]).sum())
    return {"step_s": step, "mass": float(worst[0]), "energy": float(worst[1]), "lanes": lanes, "pistons_at_stops": met}


def adiabat() -> dict[str, float]:
    """Drift of P V^gamma of insulated, shut chambers while a hand of 150 N squeezes them for a second, relative."""
    shut = {"valves.leakage_ratio": 0.0, "chambers.wall_heat_transfer": 0.0, "chambers.piston_conductance": 0.0}
    rig = Parameters().replace(shut)
    plant = Plant(rig)
    invariants, volumes = [], []
    for k in range(50):
        volume = Volumes(rig, plant.state).volume
        invariants.append(plant.state[P] * volume**GAMMA)
        volumes.append(volume)
        plant.advance(np.zeros((4, 1)), np.array([[150 * np.sin(np.pi * (k + 0.5) / 50)], [0.0]]), 0.02)
    drift = np.abs(np.array(invariants) / invariants[0] - 1).max()
    return {"drift": float(drift), "squeezed": float((np.max(volumes, axis=0) / np.min(volumes, axis=0) - 1).max())}


def mechanical_energy(step: float) -> dict[str, float]:
    """Gap of m v^2/2 + m g y against the work of pressures and hand, less friction, over 2 s, relative to the work done.

    The work is summed by trapezoids of one step, which are of second order: the gap is theirs.
    """
    rig, lanes, rng = Parameters(), LANES, np.random.default_rng(1)
    plant = Plant(rig, lanes)
    mass, weight = rig.mechanics.mass, rig.mechanics.mass * rig.mechanics.gravity

    def energy() -> Array:
        motion = plant.end_effector()
        found: Array = 0.5 * mass * (motion[2] ** 2 + motion[3] ** 2) + weight * motion[1]
        return found

    def power(push: Array) -> Array:
        # What the pistons pass on: m a = F, so that power is force times speed of each piston, friction taken off.
        rates, motion = plant.derivatives(plant.state, np.zeros((4, lanes)), push), plant.end_effector()
        s, friction = plant.state, rig.friction
        total: Array = push[0] * motion[2] + push[1] * motion[3]
        for row, cylinder, pp, pn in ((0, rig.cylinder1, 6, 8), (2, rig.cylinder2, 10, 12)):
            speed, bristle = s[row + 1], s[4 + row // 2]
            net = s[pp] * cylinder.area_p - s[pn] * cylinder.area_n
            net = net - rig.air.atmospheric_pressure * (cylinder.area_p - cylinder.area_n)
            drag = friction.bristle_stiffness * bristle + friction.bristle_damping * rates[4 + row // 2]
            total = total + (net - drag - cylinder.viscous_friction * speed) * speed
        return total

    start, work, moved = energy(), np.zeros(lanes), np.zeros(lanes)
    for k in range(round(SECONDS / step)):
        if k % round(0.1 / step) == 0:
            push = rng.uniform(-60, 60, (2, lanes))
        before = power(push)
        plant.advance(np.zeros((4, lanes)), push, step)
        mean = 0.5 * (before + power(push)) * step
        work, moved = work + mean, moved + np.abs(mean)
    return {"step_s": step, "gap": float((np.abs(energy() - start - work) / moved).max()), "work_j": float(moved.max())}


def measure() -> dict[str, Any]:
    """All balances."""
    return {
        "clear": [chambers(factor * INTEGRATION_STEP, collide=False) for factor in (2, 1, 0.5)],
        "collisions": [chambers(factor * INTEGRATION_STEP, collide=True) for factor in (1, 0.5, 0.25)],
        "adiabat": adiabat(),
        "mechanical": [mechanical_energy(factor * INTEGRATION_STEP) for factor in (1, 0.5, 0.25)],
    }
