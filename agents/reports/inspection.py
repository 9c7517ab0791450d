"""What a residual has learned: its correction where the force that the law leaves out is known, and what a hand then feels.

All experiments are of a rig with ideal sensors; a correction is the force that the residual makes the law believe in.
"""

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import gymnasium
import numpy as np

from agents.policy.controller import PolicyFunction
from agents.policy.files import Policy
from agents.residual.settings import ResidualSettings
from baselines.bench.pneumatic_range import pneumatic_setpoint
from baselines.bench.probes import POSES, StiffnessTest, run_stiffness_test
from baselines.bench.statistics import quantile
from baselines.controller import Controller
from birthsim_env.loop.signals import displacement
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_parameters
from birthsim_env.parts.hands.user_forces import ForceProfile
from birthsim_env.parts.references import Circle, FixedTarget, Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import theta1
from birthsim_env.physics.rig.parameters import Parameters

FRICTIONLESS = {f"cylinder{i}.{name}": 0.0 for i in (1, 2) for name in ("coulomb_friction", "pressure_friction")}
"""Changes of a rig that take its dry friction away."""

PLACES, RUBBED = 128, 32
"""Places in the workspace at which the correction is looked at, and rigs that go round a circle."""

ROUND = 4.0
"""s, that a circle takes."""

SLIDING = 0.01
"""m/s: a faster piston tells friction clearly."""

SETPOINTS, FORCES = (1000.0, 2000.0, 3000.0, 4000.0), (10.0, 20.0, 40.0)
"""N/m and N, of the stiffness test on rigs drawn at random."""

RIGS = 4
"""Random rigs for each pose, force, direction and setpoint."""


def _follow(
    policy: PolicyFunction,
    settings: ResidualSettings,
    lanes: int,
    seconds: float,
    trajectory: Trajectory,
    ranges: dict[str, tuple[float, float]],
    rig: Parameters,
) -> tuple[Any, dict[str, Array]]:
    """Lanes without a hand at 2000 N/m under the policy; the environment, and by name what was at each of T steps, (T, N, 2).

    ``correction`` is the believed force, N; the others are of ``info``.
    """
    env: Any = gymnasium.make_vec(
        "BirthSIM/ProbeResidual-v3",
        num_envs=lanes,
        reference=trajectory,
        user_force=ForceProfile(),
        parameters=rig,
        stiffness=StiffnessSchedule(),
        randomize=ranges or False,
        duration=seconds,
        autoreset_mode="SameStep",
        **settings.to_dict(),
    )
    rows = [k for k, name in enumerate(env.observation_names) if name.startswith("smoothed action: believed force")]
    taken: dict[str, list[Array]] = {
        name: [] for name in ("correction", "piston_position", "piston_velocity", "tracking_error")
    }
    observation, info = env.reset(seed=0)
    for _ in range(env.steps - 1):
        observation, _, _, _, info = env.step(policy(observation))
        taken["correction"].append(settings.authority * observation[:, rows].astype(np.float64))
        for name in list(taken)[1:]:
            taken[name].append(info[name])
    return env, {name: np.array(steps) for name, steps in taken.items()}


def _drawn(*names: str) -> dict[str, tuple[float, float]]:
    """The ranges from which training draws these parameters."""
    ranges = documented_ranges(Parameters())
    return {name: ranges[name] for name in names}


def weight_over_workspace(policy: Policy) -> tuple[Array, Array]:
    """Correction on cylinder 2 and m g cos(theta1), N, (PLACES,) each: held still, without friction, masses drawn at random."""
    hold, rig = FixedTarget(((0.40, 0.60), (-0.12, 0.08))), Parameters().replace(FRICTIONLESS)
    ranges = _drawn("mechanics.mass")
    env, taken = _follow(policy.network.acting(), policy.settings, PLACES, 3.0, hold, ranges, rig)
    mass = env.simulation.plant.lane_parameters[at.MASS]
    angle = theta1(taken["piston_position"][-1, :, 0], rig)
    return taken["correction"][-100:, :, 1].mean(axis=0), mass * rig.mechanics.gravity * np.cos(angle)


def friction_along_circle(policy: Policy) -> tuple[Array, Array]:
    """Round the circle of Fig. 4: the Coulomb friction that the law believes in less that of the rig, N, and half the
    difference between the corrections while a piston moves out and in, N; (2, RUBBED) each, of cylinders 1 and 2.

    The halves tell friction, which turns round with the speed, from weight; and the mean of both ways round, since one way
    round the weight along cylinder 2 goes with its speed, and the other way against it. Frictions are drawn at random.
    """
    rig, halves = Parameters(), np.zeros((2, RUBBED))
    ranges = _drawn("cylinder1.coulomb_friction", "cylinder2.coulomb_friction")
    for period in (ROUND, -ROUND):
        env, taken = _follow(policy.network.acting(), policy.settings, RUBBED, 12.0, Circle(period=period), ranges, rig)
        speed, correction = (np.moveaxis(taken[name][400:], 2, 0) for name in ("piston_velocity", "correction"))
        outwards, inwards = (correction.mean(axis=1, where=moves) for moves in (speed > SLIDING, speed < -SLIDING))
        halves += (outwards - inwards) / 4
    believed = np.array([[rig.cylinder1.coulomb_friction], [rig.cylinder2.coulomb_friction]])
    return believed - env.simulation.plant.lane_parameters[[at.FC1, at.FC2]], halves


def frictionless_circle(policy: Policy) -> tuple[float, float]:
    """Settled RMS error on x, mm, of the law and with the policy: a circle of 100 mm in 4 s at 2000 N/m without friction."""
    rig, circle = Parameters().replace(FRICTIONLESS), Circle(radius=0.1)
    errors = []
    for act in (lambda seen: np.zeros((len(seen), policy.network.outputs)), policy.network.acting()):
        _, taken = _follow(act, policy.settings, 1, 12.0, circle, {}, rig)
        errors.append(1e3 * float(np.sqrt(np.mean(taken["tracking_error"][400:, 0, 0] ** 2))))
    return errors[0], errors[1]


def rendered(controllers: Sequence[tuple[str, Controller]], seed: int = 0) -> list[dict[str, Any]]:
    """Stiffness test on rigs drawn at random: per setpoint and controller the median and 95 % of the error of the rendered
    stiffness, %, and of the hunting on x and y, mm, and how many of the cases were lost."""
    rng, rows = np.random.default_rng(seed), []
    for setpoint in SETPOINTS:
        cases = [case for case in product(POSES, FORCES, range(4)) for _ in range(RIGS)]
        position = np.array([pose for pose, _, _ in cases]).T.copy()
        angle = np.array([direction * math.pi / 2 for _, _, direction in cases])
        force = np.array([size for _, size, _ in cases]) * np.stack([np.cos(angle), np.sin(angle)])
        stiffness = np.repeat([[setpoint], [setpoint], [0.0]], len(cases), axis=1)
        rigs = [draw_parameters(Parameters(), documented_ranges(Parameters()), rng) for _ in cases]
        pneumatic = pneumatic_setpoint(position, np.stack(displacement(*force, *stiffness)), force, Parameters())
        probes = StiffnessTest(position, force, stiffness, rigs, pneumatic)
        for name, controller in controllers:
            answers = run_stiffness_test(probes, controller, seed=seed)
            metrics = {"error_percent": np.abs(100 * answers.stiffness_error(force))}
            metrics |= {f"hunting_{axis}_mm": 1e3 * answers.hunting[k] for k, axis in enumerate("xy")}
            row = {"setpoint": setpoint, "controller": name, "lost": int(answers.lost.sum()), "cases": len(cases)}
            for label, values in metrics.items():
                row |= {f"{label}_{key}": quantile(values, fraction) for key, fraction in (("median", 0.5), ("q95", 0.95))}
            rows.append(row)
    return rows
