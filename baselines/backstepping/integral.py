"""Integral action in the paper's law: a force that it is to believe in, which grows with the position error.

The law takes a force that acts along a piston off F*, and its rate off dF*/dt. What its model lacks (weight, friction, a wrong
mass) is such a force. With the error (ex, ey) of the end effector and the stiffness K asked for, without coupling as in (18),
it is found at the rate a:
    dI/dt = a J^T K (ex, ey).
At rest the law leaves J^T K (ex, ey) = f - I of a force f that nobody told it, so that dI/dt = a (f - I). As in integral
backstepping (R. Skjetne and T. I. Fossen, Proceedings of OCEANS 2004) the error is driven to zero whatever the constant force;
but a hand's push is such a force too:

- with the error from the target, the law needs no force sensor, and gives way to quick pushes alone. It has no stiffness left
  for slow ones, which the integral takes for an error of the model;
- with the error from where the spring asked for would be under the measured force, the stiffness stays as asked for.

I rests while a valve of its cylinder saturates (conditional integration).
"""

from pathlib import Path
from typing import Any, ClassVar

from baselines.backstepping import law as backstepping_law
from baselines.backstepping.controller import BacksteppingController
from baselines.backstepping.law import Options
from baselines.controller import checked_gains
from baselines.estimation.stages import PistonEstimate
from baselines.impedance import Impedance
from baselines.staged import ControllerStage
from birthsim_env.loop.rows import Feedforward, Seen
from birthsim_env.loop.signals import Reference
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, rows
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register


class Integrated(Rows):
    """What the law remembers."""

    force = rows("1 2", "N", "I, along a cylinder")


class Constants(Numbers):
    """Of the stage."""

    options = part(Options, "of the law")
    period = number("s", "control period")
    integral_rate = number("1/s", "a")
    compliant = number("1", "1 where the error is that from the spring under the measured force, else 0")
    rig = part(Rig, "the rig as described")


@kernel
def control(world: int, seen: Seen, memory: Integrated, constants: Constants, tables: int, lane: int, n: int) -> int:
    """The paper's law, which believes in the integrals besides; carries them on."""
    p, asked, believed = constants.rig, seen.asked, seen.feedforward
    joints, told = PistonEstimate(seen.intermediate[: PistonEstimate.size]).joints, Feedforward(scratch(Feedforward.size))
    found = Feedforward(scratch(Feedforward.size))
    for i in range(n):
        _, r2, _, _, _, kappa, sine, cosine = geometry.pose(
            joints.position[0, i], joints.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        kx, ky = asked.stiffness[0, i], asked.stiffness[1, i]
        ex, ey = r2 * sine - asked.position[0, i], -r2 * cosine - asked.position[1, i]
        push_x, push_y = kx * ex, ky * ey
        if constants.compliant > 0.0:
            push_x, push_y = push_x - seen.user_force[0, i], push_y - seen.user_force[1, i]
        found.rate[0, i] = -constants.integral_rate * kappa * (cosine * push_x + sine * push_y)
        found.rate[1, i] = constants.integral_rate * (sine * push_x - cosine * push_y)
        for k in range(2):
            told.force[k, i], told.rate[k, i] = believed.force[k, i], believed.rate[k, i]
            believed.force[k, i] += memory.force[k, i]
            believed.rate[k, i] += found.rate[k, i]
    missed = backstepping_law.command(seen, joints, p, constants.options, n)
    for i in range(n):
        for k in range(2):
            believed.force[k, i], believed.rate[k, i] = told.force[k, i], told.rate[k, i]
            if max(abs(seen.opening[2 * k, i]), abs(seen.opening[2 * k + 1, i])) < 1.0:
                memory.force[k, i] += constants.period * found.rate[k, i]
    return missed


@register(
    controller="backstepping-integral",
    about="The paper's law with weight compensation and an integral of the position error: no stiffness for slow pushes.",
    order=16,
)
class IntegralBackstepping(BacksteppingController):
    """The paper's law with weight compensation and integral action (this module).

    Arguments: ``parameters`` as in ``BacksteppingController``; integral_rate: a, 1/s.
    Raises ``ValueError`` for a rate that is not positive.
    """

    TUNABLE: ClassVar[dict[str, tuple[float, float]]] = {"integral_rate": (0.1, 10.0)}
    RATES: ClassVar[tuple[float, float]] = (0.1962, 0.1252)
    """1/s, for exact and for sampled positions; ``birthsim tune`` found them, as those of ``baselines.rivals.pid``."""

    compliant: ClassVar[bool] = False
    """Whether it integrates the distance from the spring under the measured force, or that from the target."""

    def __init__(self, parameters: Parameters | str | Path | None = None, **gains: float) -> None:
        gains = checked_gains(self, gains)
        super().__init__(parameters, weight_compensation=True)
        self._rates = [gains.get("integral_rate", rate) for rate in self.RATES]

    def declared_impedance(self, reference: Reference) -> Impedance | None:  # type: ignore[override]
        """What the gains render to slow pushes, as the paper's law does; None where the integral takes that away."""
        return super().declared_impedance(reference) if self.compliant else None

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        *before, _ = super().controller_stages(sampled)
        period = self.parameters.electronics.control_period
        own: dict[str, Any] = {"integral_rate": self._rates[sampled], "compliant": self.compliant}
        constants = Constants.numbers(options=self._options, period=period, rig=self._p, **own)
        return [*before, ControllerStage(control, constants, Integrated.lane())]


@register(
    controller="backstepping-integral-compliant",
    about="The paper's law with weight compensation and an integral of the distance from the spring under the measured force.",
    needs={"force sensor"},
    order=17,
)
class CompliantBackstepping(IntegralBackstepping):
    """The paper's law with integral action that keeps its stiffness, and needs a force sensor; arguments are the same."""

    reads_force = True
    compliant: ClassVar[bool] = True
    RATES: ClassVar[tuple[float, float]] = (4.449, 5.918)
