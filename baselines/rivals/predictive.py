"""Nonlinear model predictive control: both pistons and all chambers planned ahead, in real time.

At every control period the flows into the four chambers are planned over a ``horizon``, with the least sum of squares of its
residuals within what the valves can give: one Gauss-Newton step from the plan of the period before (real-time iteration), a
quadratic programme with bounds. The first flow goes to the valves through the exact inverse of their characteristic. Motion,
friction and disturbances are those that the admittance law knows when it does not learn.

This command found the tolerances with lab, from those with ideal, which it had not bettered. It is as short as its trials are
long:
    birthsim tune --controller nonlinear-mpc --trials 9 --lanes 4 --seed 1 --sensors lab --start gains.json --out out/tune
"""

import math
from pathlib import Path
from typing import ClassVar

import numpy as np

from baselines.admittance import estimator
from baselines.admittance.rows import Estimate, EstimatorParameters, Memory
from baselines.controller import checked_gains, require_stiffness
from baselines.estimation import admittance, reference_friction
from baselines.estimation.admittance import DAMPING_RATIO
from baselines.impedance import Impedance, mass_spring_damper
from baselines.rivals.horizon import FLOWS, GENERATED, HALF, NODES, SIZE, Horizon, HorizonInputs, programme
from baselines.rivals.quadratic import minimise, slope
from baselines.staged import ControllerStage, StagedController
from baselines.valve_inverse import flow_ranges, openings_for_flows
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Measurement, Point, Reference
from birthsim_env.loop.stage import block, scratch
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array
from birthsim_env.physics.compiled.records import part
from birthsim_env.physics.dynamics import load
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register

__all__ = ["GENERATED", "NonlinearMPC"]

STEPS = (0.002, 0.003, 0.005, 0.007, 0.010, 0.013, 0.017)
"""s, assumed: from node to node of the horizon, 57 ms in all; rounded to whole control periods."""

NODES_WEIGH = 0.01
"""s: a node that stands for so much time has the weight 1."""

LAST = 3.0
"""Weight of the last node, which stands for the time beyond the horizon; assumed."""


class Constants(EstimatorParameters):
    """Of the stage."""

    horizon = part(Horizon, "of the plan")


@helper
def predict_horizon(seen: Seen, memory: Memory, estimate: Estimate, constants: Constants, inputs: HorizonInputs) -> None:
    """Writes all of ``inputs`` but the present flows: friction follows the motion, what was observed besides stays."""
    ticks, steps, n = constants.horizon.tick, constants.horizon.step, memory.fresh.shape[0]
    offset, bristles = Point(scratch(Point.size)[:, :n]), scratch(2)[:, :n]
    load(memory.joints.rows, 0, n, inputs.joints.rows)
    load(memory.chambers.pressure, 0, n, inputs.pressure)
    load(memory.offset.rows, 0, n, offset.rows)
    load(estimate.inputs.force, 0, n, inputs.force)
    load(memory.bristle, 0, n, bristles)
    admittance.forecast(offset, seen.asked, estimate.inputs.force, constants.compliance, ticks, inputs.motion)
    reference_friction.forecast(inputs.motion, inputs.pressure, constants.model.rig, steps, bristles, inputs.unseen)
    for k in range(NODES):
        for axis in range(2):
            row = 2 * k + axis
            for i in range(n):
                observed = estimate.unseen[axis, i] - estimate.inputs.believed[axis, i]
                inputs.unseen[row, i] = observed - constants.friction_fraction * inputs.unseen[row, i]
                inputs.stiffness[row, i] = (
                    seen.asked.pneumatic_stiffness[axis, i]
                    + constants.model.period * ticks[k] * seen.asked.pneumatic_stiffness_rate[axis, i]
                )


@helper
def improve(plan: Array, inputs: HorizonInputs, low: Array, high: Array, constants: Constants, n: int) -> None:
    """A Gauss-Newton step of ``plan`` (SIZE, n) within flows (FLOWS, n); no flow in a lane without numbers."""
    h, g, c, p = scratch(HALF), scratch(SIZE), scratch(SIZE), scratch(PARAMETERS)
    for row in range(PARAMETERS):
        for i in range(n):
            p[row, i] = constants.model.rig.rows[row]
    programme(plan, inputs, p, constants.horizon, h, g, n)
    for row in range(SIZE):
        for i in range(n):
            c[row, i] = 0.0
    slope(h, plan, c, c, n)
    for row in range(SIZE):
        for i in range(n):
            c[row, i] = g[row, i] - c[row, i]
    for i in range(n):
        total = 0.0
        for row in range(SIZE):
            total += abs(c[row, i])
        if not math.isfinite(total):
            for row in range(SIZE):
                plan[row, i], c[row, i] = 0.0, 0.0
            for row in range(HALF):
                h[row, i] = 1.0
            for row in range(FLOWS):
                low[row, i], high[row, i] = 0.0, 0.0
    minimise(h, c, low, high, plan, n)


@kernel
def control(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    """One control period of a block; returns how many stiffness setpoints are not positive definite."""
    whole = block(memory, SIZE + int(constants.rows_of_memory))
    signals, estimate = Seen(seen.rows[:, :n]), Estimate(scratch(Estimate.size)[:, :n])
    plan, (own, bank) = whole[:SIZE], estimator.parts(whole[SIZE:, :n], constants)
    inputs, low, high = HorizonInputs(scratch(HorizonInputs.size)[:, :n]), scratch(FLOWS)[:, :n], scratch(FLOWS)[:, :n]
    missed = estimator.estimate(signals, own, bank, estimate, constants)
    predict_horizon(signals, own, estimate, constants, inputs)
    flow_ranges(inputs.pressure, own.chambers.spool, constants.model.rig, low, high, inputs.flow)
    improve(plan, inputs, low, high, constants, n)
    openings_for_flows(plan[:FLOWS, :n], inputs.pressure, constants.model.rig, own.chambers.opening)
    load(own.chambers.opening, 0, n, signals.opening)
    # The plan as the next period will see it: each step's flow moves towards that of the next.
    for k in range(NODES - 1):
        fraction = constants.model.period / constants.horizon.step[k]
        for row in range(FLOWS * k, FLOWS * (k + 1)):
            for i in range(n):
                plan[row, i] += fraction * (plan[row + FLOWS, i] - plan[row, i])
    return missed


@register(
    controller="nonlinear-mpc",
    about="Plans 57 ms ahead at every millisecond, with a model of the rig.",
    needs={"force sensor"},
    order=33,
)
class NonlinearMPC(StagedController):
    """The controller of this module.

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        gains: those of ``TUNABLE``, SI units. Where one is not given, ``TUNED`` has its value for the sensors in use.
            speed_tolerance (m/s), stiffness_tolerance (N/m) and flow_tolerance (kg/s) are errors that count as much as a
            position error of ``POSITION_TOLERANCE``. The others are gains of ``AdmittanceController`` too.

    Raises ``ValueError`` for unknown gains and values out of range.
    """

    POSITION_TOLERANCE = 1e-4
    """m."""

    TUNABLE: ClassVar[dict[str, tuple[float, float]]] = {
        "speed_tolerance": (2e-3, 3e-2),
        "stiffness_tolerance": (100.0, 1000.0),
        "flow_tolerance": (2e-4, 5e-3),
        "bandwidth": (30.0, 120.0),
        "pressure_bandwidth": (30.0, 300.0),
        "friction_fraction": (0.5, 1.0),
    }
    TUNED: ClassVar[dict[str, dict[str, float]]] = {
        "ideal": {
            "speed_tolerance": 0.002222, "stiffness_tolerance": 598.6, "flow_tolerance": 0.00262,
            "bandwidth": 58.08, "friction_fraction": 0.9648,
        },
        "lab": {
            "speed_tolerance": 0.007494, "stiffness_tolerance": 479.9, "flow_tolerance": 0.004983,
            "bandwidth": 31.26, "pressure_bandwidth": 171.4, "friction_fraction": 0.6333,
        },
    }  # fmt: skip

    def __init__(self, parameters: Parameters | str | Path | None = None, **gains: float) -> None:
        gains = checked_gains(self, gains)
        super().__init__(parameters)
        self._gains = {kind: {**tuned, **gains} for kind, tuned in self.TUNED.items()}

    def declared_impedance(self, reference: Reference) -> Impedance:
        """The mass, damper and spring of the admittance, over N lanes."""
        return mass_spring_damper(reference, self.parameters.mechanics.mass, DAMPING_RATIO)

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        rig, gains = self.parameters, self._gains["lab" if sampled else "ideal"]
        period, tau = rig.electronics.control_period, rig.valves.time_constant
        periods = np.maximum(np.round(np.array(STEPS) / period), 1)
        time = periods * period
        horizon = Horizon.numbers(
            tick=np.cumsum(periods),
            step=time,
            kept=np.array([exact.number("exp", -one / 2 / tau) for one in time]),
            weight=np.sqrt(time / NODES_WEIGH * np.where(np.arange(NODES) == NODES - 1, LAST, 1.0)),
            position=self.POSITION_TOLERANCE,
            **{name: gains[f"{name}_tolerance"] for name in ("speed", "stiffness", "flow")},
        )
        constants = Constants.numbers(**estimator.estimator_parameters(rig, sampled, sampled, gains), horizon=horizon)
        return [ControllerStage(control, constants, np.concatenate([np.zeros(SIZE), estimator.fresh_memory(rig, sampled)]))]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        require_stiffness(reference, 0.0)
