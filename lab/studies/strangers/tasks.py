"""A rig that the model lacks: its log, what identification says of it, and what controllers do on it before and after."""

from collections.abc import Callable

import numpy as np

from baselines.backstepping.controller import BacksteppingController
from baselines.bench.probes import HOLD, POSES, REST, RISE, WINDOW, RampedForces
from baselines.bench.resting import RestingRigs
from baselines.identification.experiment import PNEUMATIC, STIFFNESS, propose
from baselines.identification.identified import MISFIT, identify
from baselines.identification.laboratory import run_plan
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.loop.signals import REFERENCES, Reference
from birthsim_env.loop.stage import Part
from birthsim_env.parts.points import Through
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.linkage.inverse_kinematics import pistons_at
from birthsim_env.physics.rig.parameters import Parameters, value_of
from lab.studies.recovery.tasks import SENSORS, drawn_rig
from lab.studies.strangers.model import Strangeness, Stranger

STRANGERS: dict[str, tuple[dict[str, float], dict[str, object], dict[str, float]]] = {
    "nothing": ({}, {}, {}),
    "friction 30 % larger outwards": ({"friction_asymmetry": 0.3}, {}, {}),
    "friction +-30 % along the stroke": ({"friction_wave": 0.3}, {}, {}),
    "elasto-plastic friction": ({}, {"friction.law": "elasto_plastic"}, {}),
    "pistons that leak": ({"piston_leak": 2e-11}, {}, {}),
    "a supply line": ({"line_conductance": 8e-9}, {}, {}),
    "spools of second order, 60 Hz": ({"spool_frequency": 60.0}, {}, {}),
    "play of the valves, 1 %": ({"play": 0.01}, {}, {}),
    "commands 2 ms late": ({"delay": 0.002}, {}, {}),
    "a handle on a spring, 30 Hz": ({"handle_frequency": 30.0}, {}, {}),
    "bore of cylinder 1 measured 4 % too small": ({}, {}, {"cylinder1.piston_diameter": 0.96}),
    "lever measured 3 % too long": ({}, {}, {"geometry.d6": 1.03}),
}
"""Name -> what the rig has besides, what else it is, and factors on what its owner believes."""

RADIUS, TURN, TURNS = 0.03, 4.0, 2.0
"""m, s and number of turns of the circle; the last turn counts."""

FORCE = 25.0
"""N: push of the stiffness test, in a direction that the seed draws."""

LOST = 0.05
"""m: an end effector farther from where it should be is lost."""


def strange(rig: Parameters, strangeness: Strangeness) -> Callable[[RestingRigs], Part]:
    """Makes the rig with its ``strangeness`` move in the place of the plant of a loop of one rig."""

    def carry(loop: RestingRigs) -> Part:
        state, joints, column = loop.plant.state, np.empty((4, 1)), Rig(parameter_column(rig))
        stranger = Stranger(rig, strangeness, loop.motion[:, 0], state[:, 0])

        def move(_: int) -> None:
            stranger.advance(loop.opened[:, 0], loop.pushed[:, 0], loop.period)
            pistons_at(np.ascontiguousarray(stranger.seen[:, None]), column, joints)
            state[[at.Y1, at.Y2, at.V1, at.V2]] = joints
            state[list(at.PRESSURES), 0], state[list(at.TEMPERATURES), 0] = stranger.air
            loop.moves()

        return move

    return carry


def judged(rig: Parameters, carry: Callable[[RestingRigs], Part], believed: Parameters, controller: str, seed: int) -> Result:
    """Settled error on a circle, m, relative error of the static stiffness, and whether the end effector is lost; ``honest``
    sensors, of which ``admittance`` and others use the hand's force."""
    asked = np.zeros((REFERENCES, 1))
    asked[:2], asked[8:10], asked[10:12] = np.transpose([POSES[0]]), STIFFNESS, np.transpose([PNEUMATIC])
    angle = 2 * np.pi * np.random.default_rng(seed).random()
    push = FORCE * np.array([np.cos(angle), np.sin(angle)])

    def begun(hand: Callable[[RestingRigs], list[Part]]) -> RestingRigs:
        loop = RestingRigs([rig], Reference(asked.copy()), make_controller(controller, believed), "honest", seed, name="law")
        loop.close(hand(loop), carry=[carry(loop)])
        return loop

    loop = begun(lambda _: [RampedForces(push[:, None]).stage()])
    path = loop.path(round((REST + RISE + HOLD) / loop.period))[:, :, 0]
    window, rested = round(WINDOW / loop.period), round(REST / loop.period)
    given = path[-window:].mean(axis=0) - path[rested - window : rested].mean(axis=0)
    hunting = float(np.ptp(path[-window:], axis=0).max())

    times = np.arange(0.0, TURN * TURNS + 0.5, 0.01)
    phase = 2 * np.pi * np.maximum(times - 0.5, 0.0) / TURN
    target = asked[:2] + RADIUS * np.array([np.sin(phase), np.cos(phase) - 1.0])
    course = Through(times, target.T, within=False)

    def follow(loop: RestingRigs) -> list[Part]:
        def lead(_: int) -> None:
            loop.asked[:8] = course.sample(loop.time)

        return [lead]

    loop = begun(follow)
    count = round(times[-1] / loop.period)
    place = loop.path(count)[:, :, 0]
    wanted = np.array([course.sample(np.full(1, k * loop.period))[:2, 0] for k in range(count)])
    settled = np.linalg.norm(place - wanted, axis=1)[-round(TURN / loop.period) :]
    along = float(given @ push) / FORCE
    if not (np.isfinite(place).all() and settled.max() < LOST and along > 0):
        return {"lost": True, "error": 0.0, "hunting": 0.0, "stiffness": 0.0}
    error = float(np.sqrt(np.mean(settled**2)))
    return {"lost": False, "error": error, "hunting": hunting, "stiffness": FORCE / STIFFNESS / along - 1.0}


def meet(stranger: str, seed: int, duration: float, controllers: list[str]) -> Result:
    """One rig of a seed: log, identification, and controllers that believe the owner's rig or the identified one."""
    odd, other, wrong = STRANGERS[stranger]
    rig, owner = drawn_rig(seed).replace(other), Parameters()
    owner = owner.replace({name: factor * value_of(owner, name) for name, factor in wrong.items()})
    carry = strange(rig, Strangeness(**odd))
    plan = propose(owner, duration, seed)
    trial = run_plan(plan, [rig], BacksteppingController(owner), SENSORS, seed, carry=carry)[0]
    found = identify(trial, owner, seed)
    beliefs: dict[str, Parameters] = {"owner": owner, "identified": found.rig}
    return {
        "misfit": list(found.misfit), "warned": max(found.misfit) > MISFIT,
        "mass": value_of(found.rig, "mechanics.mass") / value_of(rig, "mechanics.mass") - 1.0,
        "friction": [
            value_of(found.rig, name) / value_of(rig, name) - 1.0
            for name in ("cylinder1.coulomb_friction", "cylinder2.coulomb_friction")
        ],
        "inside": sum(row.low <= value_of(rig, row.name) <= row.high for row in found.rows if row.determined),
        "told": sum(row.determined for row in found.rows),
        "controllers": {
            name: {belief: judged(rig, carry, one, name, seed) for belief, one in beliefs.items()} for name in controllers
        },
    }  # fmt: skip


def stranger_tasks(rigs: int, seed: int, duration: float, controllers: list[str]) -> dict[tuple[str, int], Task]:
    """A piece per stranger and rig, with seeds from ``seed`` on."""
    settings = {"duration": duration, "controllers": controllers}
    return {
        (name, one): Task(f"{k}_{one}", meet, {"stranger": name, "seed": one, **settings})
        for k, name in enumerate(STRANGERS)
        for one in range(seed, seed + rigs)
    }
