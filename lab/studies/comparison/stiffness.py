"""What a hand feels, by pushes on the rig as its owner describes it, with ideal sensors: data for the figures.

Every study is one controller on many lanes at once (``baselines.bench.probes``); its result is JSON, None where a case was
lost.
"""

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.bench.pieces import file_stem
from baselines.bench.pneumatic_range import pneumatic_setpoint
from baselines.bench.probes import POSES, StiffnessResult, StiffnessTest, run_stiffness_test
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.loop.signals import Mask, displacement
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

SETPOINTS = (1000.0, 1500.0, 2000.0, 3000.0, 4000.0)
"""N/m, the same on both axes."""

FORCES = (5.0, 15.0, 40.0)
"""N."""

AMPLITUDES = (2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 40.0)
"""N, of the study of disturbances."""

SETPOINT, FORCE = 2000.0, 20.0
"""N/m and N, of the studies in which they do not vary."""

DIRECTIONS = 24
"""Pushes round the clock."""

GRID = tuple(product((0.4, 0.5, 0.6), (-0.08, -0.015, 0.05)))
"""m, poses over the workspace at which stiffness matrices are measured; assumed."""

COUPLED = ((3000.0, 800.0), (800.0, 1500.0))
"""N/m, the setpoint of the stiffness matrices."""

AXES = (0.0, math.pi / 2, math.pi, 3 * math.pi / 2)
"""rad, the four directions along the axes."""

Pose = tuple[float, float]


def _push(
    controller: str, rig: Parameters, cases: Sequence[tuple[Pose, float, float]], stiffness: ArrayLike
) -> tuple[StiffnessResult, Array]:
    """Results and forces (2, N) of cases (pose, size in N, direction in rad) with ``stiffness`` (3,) or (3, N), N/m.

    The pneumatic stiffness is one that the cylinders can hold in every case: what is measured is the law, not the supply.
    """
    position = np.array([pose for pose, _, _ in cases]).T
    size, angle = np.array([(size, angle) for _, size, angle in cases]).T
    force = size * np.stack([np.cos(angle), np.sin(angle)])
    setpoints = np.array(stiffness, dtype=np.float64)
    setpoints = np.ascontiguousarray(np.broadcast_to(setpoints.reshape(3, -1), (3, len(cases))))
    position = np.ascontiguousarray(position)
    pneumatic = pneumatic_setpoint(position, np.stack(displacement(*force, *setpoints)), force, rig)
    return run_stiffness_test(
        StiffnessTest(position, force, setpoints, rig, pneumatic), make_controller(controller, rig)
    ), force


def _listed(values: Array, lost: Mask) -> list[list[float | None]]:
    """Rows of ``values``, with None where ``lost``."""
    rows = zip(values.tolist(), lost.tolist(), strict=True)
    return [[None if gone else value for value, gone in zip(*row, strict=True)] for row in rows]


def stiffness_study(
    controller: str,
    source: str,
    rig: dict[str, Any],
    setpoints: Sequence[float] = SETPOINTS,
    poses: Sequence[Pose] = POSES,
    forces: Sequence[float] = FORCES,
) -> Result:
    """Rendered stiffness less the one asked for, ``error_percent``, and ``hunting_mm``: a row per setpoint, a column per
    pose, force and direction along the axes."""
    cases = list(product(poses, forces, AXES))
    asked = np.repeat(np.array(setpoints), len(cases))
    answers, force = _push(controller, Parameters.from_dict(rig), cases * len(setpoints), [asked, asked, 0 * asked])
    shape = (len(setpoints), len(cases))
    lost = answers.lost.reshape(shape)
    return {
        "setpoints": list(setpoints),
        "error_percent": _listed(100 * answers.stiffness_error(force).reshape(shape), lost),
        "hunting_mm": _listed(1e3 * answers.hunting.max(axis=0).reshape(shape), lost),
    }


def disturbance_study(
    controller: str, source: str, rig: dict[str, Any], amplitudes: Sequence[float] = AMPLITUDES, poses: Sequence[Pose] = POSES
) -> Result:
    """Distance from the compliant target (19) under a held push, ``error_mm``, and in % of the displacement asked for,
    ``error_percent``: a row per amplitude, a column per pose and direction along the axes. The weight counts."""
    cases = [(pose, size, angle) for size, (pose, angle) in product(amplitudes, product(poses, AXES))]
    answers, _ = _push(controller, Parameters.from_dict(rig), cases, (SETPOINT, SETPOINT, 0.0))
    error = np.hypot(*(answers.offset + answers.displacement - answers.expected))
    shape = (len(amplitudes), -1)
    lost = answers.lost.reshape(shape)
    return {
        "amplitudes": list(amplitudes),
        "error_mm": _listed(1e3 * error.reshape(shape), lost),
        "error_percent": _listed((100 * error / np.hypot(*answers.expected)).reshape(shape), lost),
    }


def polar_study(
    controller: str, source: str, rig: dict[str, Any], directions: int = DIRECTIONS, poses: Sequence[Pose] = POSES
) -> Result:
    """Rendered stiffness along the push, ``stiffness`` (N/m): a row per direction ``angles`` (rad), a column per pose."""
    angles = [2 * math.pi * k / directions for k in range(directions)]
    cases = [(pose, FORCE, angle) for angle, pose in product(angles, poses)]
    answers, force = _push(controller, Parameters.from_dict(rig), cases, (SETPOINT, SETPOINT, 0.0))
    rendered = (SETPOINT * (1 + answers.stiffness_error(force))).reshape(directions, -1)
    return {"angles": angles, "setpoint": SETPOINT, "stiffness": _listed(rendered, answers.lost.reshape(directions, -1))}


def ellipse_study(
    controller: str,
    source: str,
    rig: dict[str, Any],
    poses: Sequence[Pose] = GRID,
    setpoint: Sequence[Sequence[float]] = COUPLED,
) -> Result:
    """Rendered stiffness matrices (N/m), one per pose: the inverse of the compliance between pushes either way on x and y."""
    (kx, kxy), (_, ky) = setpoint
    answers, _ = _push(
        controller, Parameters.from_dict(rig), [(pose, FORCE, angle) for pose in poses for angle in AXES], (kx, ky, kxy)
    )
    moved = answers.displacement.T.reshape(-1, 4, 2)
    # Columns of the compliance: half the way between pushes to and fro.
    compliance = np.swapaxes(moved[:, :2] - moved[:, 2:], 1, 2) / (2 * FORCE)
    lost = answers.lost.reshape(-1, 4).any(axis=1) | (np.abs(np.linalg.det(np.nan_to_num(compliance))) < 1e-14)
    matrices = [None if gone else np.linalg.inv(c).tolist() for gone, c in zip(lost, compliance, strict=True)]
    return {"poses": [list(pose) for pose in poses], "setpoint": [list(row) for row in setpoint], "stiffness": matrices}


STUDIES: dict[str, Callable[..., Result]] = {"stiffness": stiffness_study, "polar": polar_study, "ellipses": ellipse_study}
"""Studies of every controller, by name."""

WEIGHED = ("backstepping", "backstepping-weight")
"""Controllers of the study of disturbances: the law without and with the weight on cylinder 2."""


def frictionless(rig: Parameters) -> Parameters:
    """``rig`` without dry friction; the viscous one stays."""
    return rig.replace({f"cylinder{i}.{name}": 0.0 for i in (1, 2) for name in ("coulomb_friction", "pressure_friction")})


def study_tasks(controllers: Sequence[dict[str, Any]], rig: Parameters) -> dict[tuple[str, str], Task]:
    """(study, label) -> task, for controllers given by their ``controller_settings``.

    The label is the controller's name; that of the study "disturbance" says beside it what friction there is.
    """
    tasks = {}
    for settings in controllers:
        name = settings["controller"]
        for study, work in STUDIES.items():
            tasks[study, name] = Task(f"studies/{study}/{file_stem(name)}", work, settings)
        if name in WEIGHED:
            for label, own in (("with friction", rig), ("frictionless", frictionless(rig))):
                stem = f"lab/studies/disturbance/{name}-{label.replace(' ', '-')}"
                tasks["disturbance", f"{name}, {label}"] = Task(stem, disturbance_study, {**settings, "rig": own.to_dict()})
    return tasks
