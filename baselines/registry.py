"""Controllers by name: the table, other packages' entry points, and a user's own file.

A factory takes the rig as its owner describes it, and keyword options, and returns a ``Controller``.
"""

import inspect
import os
from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any

from baselines.about import RESIDUAL
from baselines.admittance.controller import AdmittanceController
from baselines.backstepping.cartesian_controller import CartesianBackstepping
from baselines.backstepping.controller import BacksteppingController
from baselines.controller import Controller, check_flags, is_ready, made_controller
from baselines.limiter.controller import PortLimiter
from baselines.rivals import LinearQuadratic, NonlinearMPC, PositionPID, SlidingMode
from baselines.staged import StagedController
from baselines.uncontrolled import RandomValves, ShutValves, SlammedValves
from birthsim_env.extras import installation
from birthsim_env.parts.own_parts import from_file
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import near, shown

Factory = Callable[..., Controller]

LIMITED = "limited:"
"""Before a controller's name: the controller in a ``PortLimiter``."""

GUARDING = ("on_fault", "fault_time")
"""Options of every compiled controller: what happens where a sensor says nothing finite, see ``StagedController.protect``."""

ENTRY_POINTS = "birthsim.controllers"
"""Entry point group by which a package that builds on this one adds controllers."""


def _backstepping(parameters: Parameters, cartesian: bool = False, **options: Any) -> Controller:
    check_flags({"cartesian": cartesian})
    return CartesianBackstepping(parameters, **options) if cartesian else BacksteppingController(parameters, **options)


CONTROLLERS: dict[str, Factory] = {
    "backstepping": _backstepping,
    "admittance": AdmittanceController,
    "pid": PositionPID,
    "lqr": LinearQuadratic,
    "sliding-mode": SlidingMode,
    "nonlinear-mpc": NonlinearMPC,
}

SHORT_NAMES = {
    "backstepping-weight": "backstepping[weight_compensation=true]",
    "backstepping-frozen": "backstepping[weight_compensation=true,frozen_friction=true]",
    "backstepping-one-valve": "backstepping[weight_compensation=true,valves=one_valve]",
    "backstepping-force-first": "backstepping[force_first=true]",
    "backstepping-cartesian": "backstepping[cartesian=true]",
    "admittance-backstepping": "admittance[learn=false]",
    "admittance-adaptive": "admittance",
    "admittance-sensorless": "admittance[force_sensor=false]",
}
"""Short name -> controller with options. Tables, trained policies and recordings have the short names."""

LISTED = ("backstepping", *SHORT_NAMES, "pid", "lqr", "sliding-mode", "nonlinear-mpc")
"""Controllers that scores, the page and the stored bits have."""

UNCONTROLLED: dict[str, Factory] = {"shut-valves": ShutValves, "slammed-valves": SlammedValves, "random-valves": RandomValves}
"""What any controller should beat; ``birthsim study comparison`` leaves them out."""


def controller_names() -> list[str]:
    """Every registered name; options, and what ``SHORT_NAMES`` abbreviates, come on top."""
    return [*CONTROLLERS, *UNCONTROLLED, *(point.name for point in entry_points(group=ENTRY_POINTS))]


def split_options(name: str) -> tuple[str, dict[str, Any]]:
    """``"pid[bandwidth=60,friction_fraction=0]"`` -> the name and its options; numbers and true or false are what they say.

    Raises ``ValueError`` for options that are no such list.
    """
    if not name.endswith("]"):
        return name, {}
    plain, _, listed = name[:-1].partition("[")
    options: dict[str, Any] = {}
    for entry in listed.split(","):
        key, equals, value = (text.strip() for text in entry.partition("="))
        if not (equals and key.isidentifier() and value):
            raise ValueError(f"controller = {shown(name)}: {shown(entry)}; allowed: name[gain=60,other=2]")
        try:
            options[key] = {"true": True, "false": False}[value.lower()] if value.lower() in ("true", "false") else float(value)
        except ValueError:
            options[key] = value
    return plain, options


def resolved(name: str) -> tuple[str, dict[str, Any]]:
    """The registered name of a controller, or its file, without limits, and its options, also those of a short name."""
    plain, options = split_options(name.removeprefix(LIMITED))
    if plain.startswith(f"{RESIDUAL}:"):
        return RESIDUAL, {"policy": plain.removeprefix(f"{RESIDUAL}:"), **options}
    registered, own = split_options(SHORT_NAMES.get(plain, plain))
    return registered, {**own, **options}


def bare_name(name: str) -> str:
    """A controller's registered name, or its file, without options and limits."""
    return resolved(name)[0]


def _factory(name: str) -> Factory:
    """What makes the controller ``name`` without its options; ``ValueError`` names what is unknown and what there is."""
    plain = bare_name(name)
    if plain in CONTROLLERS or plain in UNCONTROLLED:
        return (CONTROLLERS | UNCONTROLLED)[plain]
    for point in entry_points(group=ENTRY_POINTS):
        if point.name == plain:
            try:
                factory: Factory = point.load()
            except ImportError as error:
                needs = f"; a policy needs the extra: {installation('agents')}" if plain == RESIDUAL else ""
                raise ValueError(f"{error}{needs}") from error
            return factory
    if plain.rpartition(":")[0].endswith(".py"):
        return _Own(plain, from_file("controller", plain))
    names = controller_names()
    asked = near(plain, names)
    allowed = "a registered name" if asked else ", ".join(names)
    raise ValueError(f"controller = {shown(split_options(name)[0])}{asked}; allowed: {allowed}, or path/to/file.py:Class")


class _Own:
    """Makes the controller of a user's ``part``."""

    def __init__(self, name: str, part: Any) -> None:
        self.name, self.part = name, part

    def __call__(self, parameters: Parameters, **options: Any) -> Controller:
        return made_controller(self.name, self.part, parameters, options)


def known_options(name: str) -> list[str] | None:
    """The options of a controller, which its name may carry and ``--set`` sets; None where it takes any."""
    factory: Any = _factory(name)
    kind = factory.part if isinstance(factory, _Own) else getattr(factory, "func", factory)
    if is_ready(kind) or not callable(kind):
        return []
    parameters = list(inspect.signature(kind).parameters.values())
    named, tunable = [one.name for one in parameters if one.kind is not one.VAR_KEYWORD][1:], getattr(kind, "TUNABLE", {})
    guarded = GUARDING if inspect.isclass(kind) and issubclass(kind, StagedController) else ()
    if kind is _backstepping:
        law = CartesianBackstepping if resolved(name)[1].get("cartesian") else BacksteppingController
        return [*list(inspect.signature(law).parameters)[1:], *named, *GUARDING]
    closed = tunable or len(named) + 1 == len(parameters)
    return [*named, *tunable, *guarded] if closed else None


def make_controller(name: str | os.PathLike[str], parameters: Parameters | None = None, **options: Any) -> Controller:
    """The controller ``name``, or what a user's own file has, given as ``path/to/file.py:Name``.

    A name may be short (``SHORT_NAMES``) and carry options, ``pid[bandwidth=60]``, or a policy, ``residual:circle``.
    ``limited:`` before it puts the law behind the limits of ``PortLimiter``. ``parameters`` are what environments take too.
    ``options`` are those of the controller, as its name carries them. Raises ``ValueError`` naming what is unknown and what
    there is.
    """
    if not isinstance(name, (str, os.PathLike)):
        raise ValueError(f"controller = {shown(name)}; allowed: {', '.join(controller_names())}, or path/to/file.py:Name")
    name, rig = os.fspath(name), load_parameters(parameters)
    plain, named = resolved(name)
    known = known_options(name)
    for option, value in {**named, **options}.items():
        if known is not None and option not in known:
            allowed = ", ".join(known) or "no options"
            raise ValueError(
                f"controller = {shown(name)}: {option} = {shown(value)} is unknown{near(option, known)}; allowed for {plain}: "
                f"{allowed}"
            )
    given = {**named, **options}
    guarding = {option: given.pop(option) for option in GUARDING if option in given}
    law = _factory(name)(rig, **given)
    whole = PortLimiter(law, rig) if name.startswith(LIMITED) else law
    if not guarding:
        return whole
    if not isinstance(whole, StagedController):
        raise ValueError(f"{', '.join(guarding)} for controller = {shown(name)}; allowed: for a controller of the package")
    return whole.protect(**guarding)
