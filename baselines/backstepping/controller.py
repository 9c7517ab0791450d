"""The paper's controller as a user calls it."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from baselines.backstepping import law as backstepping_law
from baselines.backstepping.gains import gains_for
from baselines.backstepping.impedance import paper_impedance
from baselines.backstepping.law import Options, Terms
from baselines.backstepping.stiffest import require_softer, stiffness_range
from baselines.controller import check_flags
from baselines.estimation.observers import measured_joints
from baselines.estimation.stages import JOINTS, PistonEstimate, pistons
from baselines.impedance import Impedance
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.rows import ACTION, ASKED, Seen
from birthsim_env.loop.signals import Joints, Measurement, Reference
from birthsim_env.parts.actuation import VALVE_LAYOUTS
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Numbers, part
from birthsim_env.physics.linkage.geometry import jacobian
from birthsim_env.physics.linkage.inverse_kinematics import piston_reference
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import is_within, limits, plain, shown
from birthsim_env.registry import register

PNEUMATIC_GAIN = 30.0
"""c4, 1/s; assumed: the pneumatic stiffness settles within 0.1 s and leaves the valves to the force."""

SIGN_WIDTH = 0.002
"""m/s; assumed: over this speed the law's sign(v) goes from rest to sliding; close to the paper's discontinuous sign."""

STEP = 1e-4
"""s; half the distance of the central difference that gives the rates of the gains, exact to 1e-7 of them."""


@dataclass(frozen=True)
class BacksteppingTerms:
    """What the law knows and wants at one instant in N lanes; the second-last axis counts cylinders 1 and 2. SI units.

    - ``joints`` (4, N): y1, y2, v1, v2 as measured or estimated;
    - ``wanted`` (8, N): yd1, yd2 and their three derivatives;
    - ``gains`` (3, 2, N): c1, c2, c3; they follow the pose, and ``gain_rates`` are their rates at constant setpoints;
    - ``wanted_force`` (2, N): F*;
    - ``force_rate`` (2, N): the dF/dt that the law asks for; ``pneumatic_stiffness_rate`` (2, N): its dK/dt.
    """

    joints: Array
    wanted: Array
    gains: Array
    gain_rates: Array
    wanted_force: Array
    force_rate: Array
    pneumatic_stiffness_rate: Array


class Constants(Numbers):
    """Of the stage."""

    options = part(Options, "of the law")
    rig = part(Rig, "the rig as described")


@kernel
def _stage(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    return backstepping_law.command(
        seen, PistonEstimate(seen.intermediate[: PistonEstimate.size]).joints, constants.rig, constants.options, n
    )


@kernel
def _inspect(seen: Seen, joints: Joints, p: Rig, options: Options, terms: Terms) -> None:
    """Writes what goes on inside ``command`` in N lanes, for analysis."""
    n, ratio = joints.rows.shape[1], options.damping_ratio
    moved, ahead, behind = (
        Joints(joints.rows.copy()),
        Terms(terms.rows.copy()),
        Terms(terms.rows.copy()),
    )
    for fraction, there in ((1.0, ahead), (-1.0, behind)):
        moved.position[:] = joints.position + fraction * STEP * joints.speed
        backstepping_law.choose_gains(moved, seen.asked, seen.damping_factor, p, ratio, there, n)
    terms.gain_rates.rows[:] = (ahead.gains.rows - behind.gains.rows) / (2.0 * STEP)
    piston_reference(seen.asked.rows, p, terms.wanted.rows, n)
    backstepping_law.choose_gains(joints, seen.asked, seen.damping_factor, p, ratio, terms, n)
    backstepping_law.law(seen, joints, terms, p, options, n)


@register(
    controller="backstepping",
    about="The paper's law: position and stiffness from pressures, without a force sensor.",
    order=10,
)
@register(
    controller="backstepping-weight",
    about="The paper's law, which also carries the weight of what moves.",
    options={"weight_compensation": True},
    order=11,
)
@register(
    controller="backstepping-frozen",
    about="The paper's law with weight compensation; friction is left out where its model errs at rest.",
    options={"weight_compensation": True, "frozen_friction": True},
    order=12,
)
@register(
    controller="backstepping-one-valve",
    about="The paper's law with one valve a cylinder: pneumatic stiffness runs free.",
    options={"weight_compensation": True, "valves": "one_valve"},
    order=13,
)
@register(
    controller="backstepping-force-first",
    about="The paper's law; where a valve saturates, pneumatic stiffness gives way to force.",
    options={"force_first": True},
    order=14,
)
class BacksteppingController(StagedController):
    """Backstepping control of position, pneumatic and closed-loop stiffness (Herzig et al. 2015, section IV and Fig. 3).

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        weight_compensation: put (14), weight and centrifugal force on cylinder 2, back into the model (the paper's section VI).
        pneumatic_gain: c4, 1/s, of the pneumatic stiffness.
        sign_width: speed, m/s, over which the sign of (4) is smoothed.
        damping_ratio: zeta of the damping B = 2 zeta sqrt(K m_e) that slow pushes meet beside the stiffness K, whatever K is at
            the time; m_e is the mass that moves, m at the end effector. None means equal gains, the least damped, with a zeta
            of about 0.8. A larger zeta takes a larger sum c1 + c2 + c3, and slow valves allow only so much. So the law takes
            c1 = c3 > c2, which makes the sum as small as it can be (``gains.gains_for``). With valves of 4 ms and up to
            4000 N/m a ratio of 2 is rendered, one of 3 no longer.
        frozen_friction: leave the Coulomb friction out of dF*/dt. The model does not know the hand, so its acceleration is not
            zero at rest. With Coulomb friction the law would then render a stiffness 25 to 90 % too high.
        valves: ``two_valves`` per cylinder, or ``one_valve``, a 5/3 valve that gives chamber N minus the opening of chamber P
            and leaves the pneumatic stiffness to itself (section VI). An environment with one valve per cylinder takes rows
            0 and 2 of the openings as its action.
        force_first: where a valve of two saturates, give up pneumatic stiffness to keep the force. The paper's law gives up
            some of both. A push that drives cylinder 2 fast into an emptying chamber then makes it stiffer than wanted. Both
            its valves drain, no force is left to come back, and the episode is lost.

    The gains follow the setpoints Kclx, Kcly at every call (18). From sampled positions an observer estimates the speeds. The
    damping factor is the damping relative to that of equal gains. Values up to 1.01 mean equal gains. It is ignored where
    ``damping_ratio`` is given.
    Raises ``ValueError`` for options that are not positive, and for an unknown layout of valves. ``command`` refuses setpoints
    without positive gains and those at which the law would swing (``stiffest``).
    """

    reads_force = False

    def __init__(
        self,
        parameters: Parameters | str | Path | None = None,
        weight_compensation: bool = False,
        pneumatic_gain: float = PNEUMATIC_GAIN,
        sign_width: float = SIGN_WIDTH,
        damping_ratio: float | None = None,
        frozen_friction: bool = False,
        valves: str = "two_valves",
        force_first: bool = False,
    ) -> None:
        ratio = 1.0 if damping_ratio is None else damping_ratio
        for name, value in (("pneumatic_gain", pneumatic_gain), ("sign_width", sign_width), ("damping_ratio", ratio)):
            if not is_within(value, least=1e-6, most=1e6):
                raise ValueError(f"{name} = {shown(value)}; allowed: a positive number{limits(least=1e-6, most=1e6)}")
        if not isinstance(valves, str) or valves not in VALVE_LAYOUTS:
            raise ValueError(f"valves = {shown(valves)}; allowed: {', '.join(VALVE_LAYOUTS)}")
        flags = {"weight_compensation": weight_compensation, "frozen_friction": frozen_friction, "force_first": force_first}
        check_flags(flags)
        if force_first and valves == "one_valve":
            raise ValueError("force_first = True; allowed: False with valves = 'one_valve', which control the force alone")
        super().__init__(parameters)
        self.damping_ratio, self.frozen_friction, self.valves = plain(damping_ratio), bool(frozen_friction), valves
        self.force_first = bool(force_first)
        self.weight_compensation, self.pneumatic_gain = bool(weight_compensation), float(pneumatic_gain)
        self._options = Options.numbers(
            pneumatic_gain=pneumatic_gain,
            sign_width=sign_width,
            weight=self.weight_compensation,
            coulomb_rate=not frozen_friction,
            damping_ratio=damping_ratio or 0.0,
            one_valve=valves == "one_valve",
            force_first=self.force_first,
        )

    def declared_impedance(self, reference: Reference) -> Impedance:
        """What the gains render to slow pushes at the reference pose, over N lanes; ``ValueError`` where there are no gains."""
        return paper_impedance(reference, self.parameters, self.damping_ratio)

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        law = ControllerStage(_stage, Constants.numbers(options=self._options, rig=self._p), np.zeros(0))
        return [stiffness_range(self.parameters, sampled), pistons(self.parameters, sampled, informed=False), law]

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        self._joints: Array = np.zeros((Joints.size, lanes))
        return [(self._joints, JOINTS)]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the error of the first lane whose setpoints are too stiff or have no gains."""
        require_softer(reference, self.parameters, measurement.sampled)
        joints = measured_joints(measurement, self._p)
        for lane, setpoints in enumerate(reference.stiffness.T):
            if not np.isfinite(joints[:, lane]).all():
                continue
            squares = jacobian(joints[:2, lane], self.parameters) ** 2
            for i, cylinder in enumerate((self.parameters.cylinder1, self.parameters.cylinder2)):
                stiffness = float(setpoints @ squares[:, i])
                apparent_mass = float(self.parameters.mechanics.mass * squares[:, i].sum())
                damping = None
                if self.damping_ratio is not None and stiffness > 0:
                    damping = 2 * self.damping_ratio * math.sqrt(stiffness * apparent_mass)
                try:
                    gains_for(stiffness, apparent_mass, cylinder.viscous_friction, damping)
                except ValueError as error:
                    given = "" if damping is None else f"damping_ratio = {self.damping_ratio:g}, "
                    place = f"{given}reference.stiffness = ({setpoints[0]:g}, {setpoints[1]:g}) N/m in lane {lane}"
                    raise ValueError(f"{place}, cylinder {i + 1}: {error}") from None

    def inspect(
        self,
        measurement: Measurement,
        reference: Reference,
        feedforward_force: Array | None = None,
        feedforward_rate: Array | None = None,
        damping_factor: Array | None = None,
    ) -> BacksteppingTerms:
        """What ``command`` would want with the same signals, over N lanes.

        Like ``command`` it lets the observer take a sampled measurement: call one of them per control period.
        """
        self.run_stages(measurement, reference, (feedforward_force, feedforward_rate, damping_factor))
        lanes = self._joints.shape[1]
        seen, joints = Seen(np.zeros((Seen.size, lanes))), Joints(self._joints.copy())
        seen.rows[:ASKED], seen.rows[ASKED:ACTION] = self._seen, self._asked
        terms = Terms(np.zeros((Terms.size, lanes)))
        _inspect(seen, joints, Rig(self._p), Options(self._options), terms)
        gains, rates = (one.rows.reshape(3, 2, lanes) for one in (terms.gains, terms.gain_rates))
        intent = terms.intent
        return BacksteppingTerms(
            joints.rows, terms.wanted.rows, gains, rates, intent.force, intent.force_rate, intent.stiffness_rate
        )
