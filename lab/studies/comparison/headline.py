"""The table of the circle: what each controller is told, and its settled error for each kind of sensors."""

import numpy as np

from agents.policy.files import read_policy
from agents.policy.seeds import policy_folders
from birthsim_env.registry import entries
from lab.engine import information
from lab.engine.tables import digits, markdown
from lab.studies.comparison.grid import LEARNED, Conditions
from lab.studies.comparison.privileged import TOLD
from lab.studies.comparison.tables import Figures, controllers_of

COLUMNS = {
    ("ideal", "nominal"): "ideal, nominal rig",
    ("ideal", "randomised"): "ideal",
    ("lab", "randomised"): "lab",
    ("honest", "described-sensors"): "honest",
}
"""Sensors and plant -> the column of their settled errors."""

RIVALS, LEFT_OUT = "baselines.rivals.", ("nonlinear-mpc",)
"""Where rivals register themselves; the planner has a page of its own."""

CONTROLLERS = (
    "backstepping", f"{TOLD}backstepping", f"{TOLD}backstepping-weight", f"{TOLD}backstepping-frozen",
    "admittance-sensorless", f"{TOLD}admittance-sensorless",
    "backstepping-integral", "backstepping-integral-compliant",
    "admittance-backstepping", "admittance-adaptive", f"{TOLD}admittance-adaptive",
    *(one.name for one in entries("controller", listed=True) if one.module.startswith(RIVALS) and one.name not in LEFT_OUT),
    *(f"{LEARNED}{name}" for name in ("circle", "circle_apg", "circle_lab", "circle_lab_apg", "circle_honest_apg")),
    f"{LEARNED}circle_honest_student",
)  # fmt: skip
"""The paper's control law as published, told its rig, with its weight compensated, and frozen at rest; the admittance family
without and with a force sensor; rivals; policies with the sensors of their training."""


def is_shown(name: str, where: Conditions) -> bool:
    """Whether a controller is measured under some conditions: a policy with the sensors that it was trained for."""
    if where.hand or (where.sensors, where.plant) not in COLUMNS:
        return False
    return not name.startswith(LEARNED) or where.sensors == trained_with(name.removeprefix(LEARNED))


def trained_with(policy: str) -> str:
    """The sensor model with which a policy was trained; "" where it does not say."""
    return str(read_policy(policy_folders(policy)[0]).training.get("sensors", ""))


def headline(figures: Figures) -> str:
    """A row per controller, with medians and their intervals; in bold the best of those that are told and sense the same."""
    found = {(cell["controller"], cell["sensors"], cell["plant"]): cell for cell in figures}
    rows = [["controller", *information.COLUMNS, *COLUMNS.values(), "lost or refused"]]
    for name in controllers_of(figures):
        own = [found.get((name, *kind)) for kind in COLUMNS]
        errors = ["-" if cell is None else _short(cell["metrics"]["settled_rms"]) for cell in own]
        lost = sum(cell["lost"] for cell in own if cell), sum(cell["episodes"] for cell in own if cell)
        bare, shown = name.removeprefix(TOLD), [sensors for (sensors, _), cell in zip(COLUMNS, own, strict=True) if cell]
        facts = information.informed(bare, *shown, rig=information.TOLD if name.startswith(TOLD) else information.DEFAULT)
        rows.append(
            [
                f"`{bare.removeprefix(LEARNED)}`" + ", policy" * name.startswith(LEARNED),
                *facts,
                *errors,
                "{} of {}".format(*lost),
            ]
        )
    return markdown(rows, [*COLUMNS.values()], alike=[(row[1], row[3]) for row in rows[1:]])


def _short(found: dict[str, float]) -> str:
    """A median with its interval, whose ends have two digits, so that four of them stand side by side."""
    low, high = ("lost" if np.isinf(found[end]) else f"{found[end]:.2g}" for end in ("low", "high"))
    return f"{digits(found['median'])} [{low}, {high}]"
