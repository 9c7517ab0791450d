"""What a residual may do, and on which law."""

from dataclasses import asdict, dataclass
from typing import Any

from baselines.named import resolved, uses_force
from birthsim_env.assembly import one_of
from birthsim_env.physics.rig.values import is_within, make_plain, shown

NO_LAW = "none"

LAWS = (
    *("backstepping", "backstepping-weight", "backstepping-frozen", "backstepping-force-first"),
    *("admittance-backstepping", "admittance-adaptive", "admittance-sensorless"),
    NO_LAW,
)
"""Laws that take forces to believe in and were tried with policies, the paper's first: with one valve a cylinder, and with a
plan for every millisecond, nobody has. And none, where a policy drives the valves by itself."""

VALVES = 4
"""Length of an action without a law: the openings of all spools."""

IMPEDANCES = {"fixed": 2, "variable_kp": 4, "variable": 5}
"""Impedance mode (the vocabulary of robosuite) -> length of an action: forces; and stiffness; and damping."""


def needs_force(law: str) -> bool:
    """Whether a law of ``LAWS`` reads the hand's force."""
    return law != NO_LAW and uses_force(law)


def is_one_of(name: str, allowed: tuple[str, ...]) -> bool:
    """Whether a law, or what else has a name, is among those allowed, whichever of its names is given."""
    try:
        return name in allowed or resolved(name) in [resolved(one) for one in allowed]
    except ValueError:  # options that are none
        return False


@dataclass(frozen=True)
class ResidualSettings:
    """What a residual may do.

    - ``law`` underneath, one of ``LAWS``, by its short name or as ``admittance[learn=false]``.
    - ``impedance``: with ``"fixed"`` an action is a force along each cylinder; with ``"variable_kp"`` also the stiffness Kclx,
      Kcly that the law works with; with ``"variable"`` its damping besides. Without a law, and on the
      admittance laws, only ``"fixed"``.
    - ``authority`` (N) bounds the force: 100 N, since the weight of 2 kg more than believed is 40 to 57 N along cylinder 1 and
      friction comes on top.
    - ``time_constant`` (s) of the low-pass between an action and the law: without it single lanes oscillate.
    - ``policy_period`` (s).
    - ``force_sensor``: without one, neither a law that ``needs_force`` nor an impedance that varies, which needs the hand's
      force.
    - ``informed``: the policy also observes ``agents.residual.features``.

    Raises ``ValueError`` for values outside these limits.
    """

    law: str = "backstepping"
    impedance: str = "fixed"
    authority: float = 100.0
    time_constant: float = 0.028
    policy_period: float = 0.01
    force_sensor: bool = True
    informed: bool = False

    def __post_init__(self) -> None:
        for name, low, high in (("authority", 0.0, 500.0), ("time_constant", 0.0, 1.0), ("policy_period", 0.0, 1.0)):
            value = getattr(self, name)
            if not is_within(value, above=low, most=high):
                raise ValueError(f"{name} = {shown(value)}; allowed: more than {low:g}, at most {high:g}")
        make_plain(self)
        for name, allowed in (("law", LAWS), ("impedance", tuple(IMPEDANCES))):
            value = getattr(self, name)
            if not isinstance(value, str) or not is_one_of(value, allowed):
                raise ValueError(f"{name} = {shown(value)}; allowed: {', '.join(map(repr, allowed))}")
        if self.impedance != "fixed" and (self.law.startswith("admittance") or self.law == NO_LAW):
            raise ValueError(f"impedance = {self.impedance!r}; allowed: 'fixed', law = {self.law!r} has no impedance to vary")
        for name in ("force_sensor", "informed"):
            object.__setattr__(self, name, one_of(name, getattr(self, name), (True, False)))
        if not self.force_sensor and (self.impedance != "fixed" or needs_force(self.law)):
            raise ValueError(
                f"force_sensor = False with law = {self.law!r}, impedance = {self.impedance!r}; allowed: impedance = 'fixed' "
                f"and a law other than {', '.join(repr(law) for law in LAWS if needs_force(law))}, which need the hand's force"
            )

    @property
    def size(self) -> int:
        """Length of an action."""
        return VALVES if self.law == NO_LAW else IMPEDANCES[self.impedance]

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it."""
        return asdict(self)
