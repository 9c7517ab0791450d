"""What the rivals share: the stages before the law, its signals, and the memory of its integrals."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from baselines.controller import checked_gains, require_stiffness
from baselines.estimation.admittance import DAMPING_RATIO
from baselines.estimation.stages import compliant_motion, pistons
from baselines.impedance import Impedance, mass_spring_damper
from baselines.rivals.feedforward import feedforward
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.records import Numbers, Rows, rows
from birthsim_env.physics.rig.parameters import Parameters


class Integrals(Rows):
    """What a law remembers."""

    integral = rows("1 2", "SI", "integral of a cylinder")
    fresh = rows("1 2", "1", "1 where it starts")


@helper
def held(memory: Integrals, cylinder: int, i: int, first: float) -> float:
    """The integral of a cylinder, or ``first`` where it starts."""
    return first if memory.fresh[cylinder, i] > 0.0 else memory.integral[cylinder, i]


@helper
def is_full(openings: tuple[float, float]) -> bool:
    """Whether a valve of a cylinder saturates."""
    opening_p, opening_n = openings
    return max(abs(opening_p), abs(opening_n)) >= 1.0


@helper
def carry_on(
    memory: Integrals, cylinder: int, i: int, integral: float, rate: float, period: float, openings: tuple[float, float]
) -> None:
    """Takes the integral to the next period; it rests while a valve of the cylinder saturates (conditional integration)."""
    memory.integral[cylinder, i] = integral if is_full(openings) else integral + period * rate
    memory.fresh[cylinder, i] = 0.0


class TrackingController(StagedController, ABC):
    """A loop round each piston that follows ``stages.compliant_motion`` and knows the forces that it needs.

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        gains: those of ``GAINS``, SI units; what is not given is the value tuned for the sensors that the controller meets.

    ``GAINS`` is gain -> (lowest, highest, for exact, for sampled positions): what ``birthsim tune`` is to try and what it
    found. All have ``friction_fraction``, how much believed Coulomb friction is fed forward with the sign of the reference
    speed; those that integrate errors have ``dead_zone``, the error at the end effector, m, up to which nothing is integrated.
    What they remember starts from the forces that the chambers hold (bumpless start). From sampled positions an observer
    estimates the speeds.
    ``LAW`` is the law as a stage, which carries its ``MEMORY`` on, in which ``fresh`` is 1 where a lane starts. ``CONSTANTS``
    are its constants: the control ``period``, s, what ``_design`` gives, and the ``rig``.
    Raises ``ValueError`` for unknown gains and for gains that are not positive (zero where the lowest to try is zero).
    """

    LAW: ClassVar[Callable[..., int]]
    CONSTANTS: ClassVar[type[Numbers]]
    MEMORY: ClassVar[type[Rows]] = Integrals
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]]
    TUNABLE: ClassVar[dict[str, tuple[float, float]]]
    COMMAND_OPTIONS: ClassVar[tuple[str, ...]] = ("damping_factor",)

    def __init_subclass__(cls) -> None:
        if "GAINS" in vars(cls):
            cls.TUNABLE = {name: row[:2] for name, row in cls.GAINS.items()}

    def __init__(self, parameters: Parameters | str | Path | None = None, **gains: float) -> None:
        gains = checked_gains(self, gains)
        super().__init__(parameters)
        # For exact and for sampled positions.
        self._gains = [{name: float(gains.get(name, row[2 + k])) for name, row in self.GAINS.items()} for k in range(2)]
        self._designs = [self._design(values) for values in self._gains]

    def declared_impedance(self, reference: Reference) -> Impedance:
        """The mass, damper and spring of the admittance, over N lanes."""
        return mass_spring_damper(reference, self.parameters.mechanics.mass, DAMPING_RATIO)

    @abstractmethod
    def _design(self, gains: dict[str, float]) -> dict[str, Any]:
        """The constants of ``LAW`` that come from the gains, all those of ``GAINS``."""

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        rig, gains, design = self.parameters, self._gains[sampled], self._designs[sampled]
        constants = self.CONSTANTS.numbers(period=rig.electronics.control_period, rig=self._p, **design)
        law = ControllerStage(self.LAW, constants, self.MEMORY.lane(fresh=1.0))
        ahead = feedforward(rig, gains["friction_fraction"])
        return [compliant_motion(rig), pistons(rig, sampled, informed=True), ahead, law]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the error of the first lane whose stiffness is not positive definite."""
        require_stiffness(reference, 0.0)
