"""Nonlinear model predictive control: what could be had with the same knowledge if computing time did not matter.

At every control period the flows into the four chambers are planned over a horizon of ``prediction``, with the least sum of
squares of its residuals within what the valves can give: one Gauss-Newton step from the plan of the period before (real-time
iteration), a quadratic programme with bounds. The first flow goes to the valves through the exact inverse of their
characteristic. Motion, friction and disturbances are those that the admittance law knows when it does not learn.

These commands found the tolerances (with ideal, then with lab and 16 trials) by the search that birthsim tune had before it
used Optuna. It was as short as its trials are long; the best was the same for both:
    birthsim tune --controller nonlinear-mpc --trials 9 --lanes 4 --seed 0 --sensors ideal --out out/tune
"""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from baselines.admittance.informed import Informed
from baselines.controller import check_gains
from baselines.estimation.admittance import DAMPING_RATIO
from baselines.impedance import Impedance, mass_spring_damper
from baselines.rivals.prediction import FLOW, FLOWS, PRESSURE, residuals, symbols
from baselines.staged import one_lane
from baselines.valve_inverse import flow_ranges, openings_for_flows
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

STEPS = (0.002, 0.003, 0.005, 0.007, 0.010, 0.013, 0.017)
"""s, assumed: from node to node of the horizon, 57 ms in all; rounded to whole control periods."""


class Buffered:
    """A CasADi function that reads the arrays ``inputs`` and writes the arrays ``outputs``, name -> non-zeros by columns."""

    def __init__(self, function: Any) -> None:
        self.inputs = {function.name_in(i): np.zeros(function.nnz_in(i)) for i in range(function.n_in())}
        self.outputs = {function.name_out(i): np.zeros(function.nnz_out(i)) for i in range(function.n_out())}
        self._buffer, self.call = function.buffer()  # the second needs the first alive
        for connect, arrays in ((self._buffer.set_arg, self.inputs), (self._buffer.set_res, self.outputs)):
            for index, array in enumerate(arrays.values()):
                view: Any = array
                connect(index, memoryview(view))


class Planner:
    """Improves a plan of one lane by a Gauss-Newton step. Arguments are those of ``residuals``."""

    def __init__(self, parameters: Parameters, steps: Array, tolerances: dict[str, float]) -> None:
        size = FLOWS * len(steps)
        self._residuals = Buffered(residuals(parameters, [float(step) for step in steps], tolerances))
        dense = {"h": symbols().Sparsity.dense(size, size)}
        self._programme = Buffered(symbols().conic("programme", "daqp", dense))

    def improve(self, plan: Array, given: Array, low: Array, high: Array) -> Array:
        """A better plan (4 M,) with flows between ``low`` and ``high`` (4,), all in FLOW; no flow in a lane without numbers.

        Where a prediction runs away, so that its programme has no solution, the plan stays as it is.
        """
        asked, programme = self._residuals.inputs, self._programme.inputs
        asked["commanded"][:], asked["given"][:] = plan, given
        self._residuals.call()
        found = self._residuals.outputs["residuals"]
        if not np.isfinite(found).all():
            return np.zeros_like(plan)
        slopes = self._residuals.outputs["slopes"].reshape(len(plan), -1)
        curvature = slopes @ slopes.T
        programme["h"][:], programme["g"][:] = curvature.ravel(), slopes @ found - curvature @ plan
        least, most = programme["lbx"], programme["ubx"]
        least[:], most[:] = np.resize(low, len(plan)), np.resize(high, len(plan))
        try:
            self._programme.call()
        except RuntimeError:
            return np.clip(plan, least, most)
        return self._programme.outputs["x"].copy()


class NonlinearMPC:
    """The law of this module. A call takes about half a millisecond per lane: it shows what computing can reach, not real time.

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        gains: those of ``TUNABLE``, SI units. Where one is not given, ``TUNED`` has its value for the sensors in use.
            speed_tolerance (m/s), stiffness_tolerance (N/m) and flow_tolerance (kg/s) are errors that count as much as a
            position error of ``POSITION_TOLERANCE``. The others are gains of ``AdmittanceController`` too.

    Needs CasADi, the extra ``mpc``. Raises ``ValueError`` for unknown gains and values out of range.
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
            "speed_tolerance": 0.002222, "stiffness_tolerance": 598.6, "flow_tolerance": 0.00262,
            "bandwidth": 58.08, "pressure_bandwidth": 208.0, "friction_fraction": 0.9648,
        },
    }  # fmt: skip

    def __init__(self, parameters: Parameters | str | Path | None = None, **gains: float) -> None:
        check_gains(self, gains)
        self.parameters = load_parameters(parameters)
        self._p, self._period = parameter_column(self.parameters), self.parameters.electronics.control_period
        chosen = {kind: {**tuned, **gains} for kind, tuned in self.TUNED.items()}
        self._informed = Informed(self.parameters, chosen)
        periods = np.maximum(np.round(np.array(STEPS) / self._period), 1)
        self._steps, self._ticks = periods * self._period, np.cumsum(periods).astype(np.int64)
        self._planners = {kind: self._planner(own) for kind, own in chosen.items()}
        self._plan: Array = np.empty((0, 0))

    def _planner(self, gains: dict[str, float]) -> Planner:
        names = ("speed", "stiffness", "flow")
        tolerances = {"position": self.POSITION_TOLERANCE, **{name: gains[f"{name}_tolerance"] for name in names}}
        return Planner(self.parameters, self._steps, tolerances)

    def declared_impedance(self, reference: Reference) -> Impedance:
        """The mass, damper and spring of the admittance, over N lanes."""
        return mass_spring_damper(reference, self.parameters.mechanics.mass, DAMPING_RATIO)

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        self._informed.reset(lanes)
        if lanes is None:
            self._plan = np.empty((0, 0))
        elif len(self._plan):
            self._plan[lanes] = 0.0

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        Called once per control period. Raises ``ValueError`` for signals over different numbers of lanes, and for a stiffness
        setpoint that is not positive definite.
        """
        if measurement.position.ndim == 1:
            return self.command(*one_lane(measurement, reference))[:, 0]
        informed, planner = self._informed, self._planners["lab" if measurement.sampled else "ideal"]
        informed.update(measurement, reference)
        known, memory = informed.known, informed.memory
        lanes, pressures = known.drag.shape[1], memory.chambers.pressure
        if len(self._plan) != lanes:
            self._plan = np.zeros((lanes, FLOWS * len(self._steps)))
        low, high, flows = (q / FLOW for q in flow_ranges(pressures, memory.chambers.spool, self._p))
        ahead, unseen = informed.forecast(reference, self._ticks)
        asked = reference.pneumatic_stiffness + self._period * self._ticks[:, None, None] * reference.pneumatic_stiffness_rate
        now = [memory.joints.rows, pressures / PRESSURE, flows, known.given.force]
        given = np.concatenate([*now, *(along.reshape(-1, lanes) for along in (unseen, ahead, asked))])
        for lane in range(lanes):
            self._plan[lane] = planner.improve(self._plan[lane], given[:, lane], low[:, lane], high[:, lane])
        openings = openings_for_flows(FLOW * np.ascontiguousarray(self._plan[:, :FLOWS].T), pressures, self._p)
        self._advance_plan()
        memory.chambers.opening[:] = openings
        return openings

    def _advance_plan(self) -> None:
        """The plan as the next period will see it: each step's flow moves towards that of the next."""
        plan = self._plan.reshape(len(self._plan), -1, FLOWS)
        fraction = (self._period / self._steps[:-1])[:, None]
        plan[:, :-1] += fraction * (plan[:, 1:] - plan[:, :-1])
