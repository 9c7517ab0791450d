"""Controllers by name: what is registered, with options, and a user's own file.

What is registered makes a controller of the rig as its owner describes it, and of options.
"""

import inspect
import os
from typing import Any, get_type_hints

from baselines.controller import RESIDUAL, Controller, controller_of, is_ready, made_controller
from baselines.limiter.controller import PortLimiter
from baselines.staged import ControllerStage, StagedController
from baselines.uncontrolled import Uncontrolled
from birthsim_env.extras import installation
from birthsim_env.loop.stage import layouts_of
from birthsim_env.parts.own_parts import from_file
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import near, shown
from birthsim_env.registry import Entry, entries, entry, names

LIMITED = "limited:"
"""Before a controller's name: the controller in a ``PortLimiter``."""

GUARDING = ("on_fault", "fault_time")
"""Options of every compiled controller: what happens where a sensor says nothing finite, see ``StagedController.protect``."""

LEARNS_MASS = "learns_mass"
"""The constant of a stage that says whether the law learns the mass."""

CONSTANTS = 3
"""Of the arguments of a controller's stage that which has its constants."""

OWN_FILE = ", or path/to/file.py:Class"


def compiled_names(listed: bool | None = None) -> list[str]:
    """Registered controllers that are stages, of which other targets are built; with ``listed`` those that are, or are not."""
    return [one.name for one in entries("controller", listed) if _makes(one.made, StagedController)]


def uncontrolled_names() -> list[str]:
    """What any controller should beat."""
    return [one.name for one in entries("controller") if _makes(one.made, Uncontrolled)]


def controlling_names() -> list[str]:
    """Listed controllers that look at the rig."""
    return [one.name for one in entries("controller", listed=True) if not _makes(one.made, Uncontrolled)]


def _makes(part: Any, base: type) -> bool:
    """Whether what a part makes derives from a class, by the class that it is, or that a function says to return."""
    kind = get_type_hints(part).get("return") if inspect.isfunction(part) else part
    return inspect.isclass(kind) and issubclass(kind, base)


def _known(kind: str) -> dict[str, Entry]:
    """Name -> entry, of which ``used`` takes no note."""
    return {one.name: one for one in entries(kind)}


def split_options(name: str) -> tuple[str, dict[str, Any]]:
    """``"pid[bandwidth=60,friction_fraction=0]"`` -> the name and its options; numbers and true or false are what they say.

    Raises ``ValueError`` for options that are no such list.
    """
    if not name.endswith("]"):
        return name, {}
    plain, _, listed = name[:-1].partition("[")
    options: dict[str, Any] = {}
    for part in listed.split(","):
        key, equals, value = (text.strip() for text in part.partition("="))
        if not (equals and key.isidentifier() and value):
            raise ValueError(f"controller = {shown(name)}: {shown(part)}; allowed: name[gain=60,other=2]")
        try:
            options[key] = {"true": True, "false": False}[value.lower()] if value.lower() in ("true", "false") else float(value)
        except ValueError:
            options[key] = value
    return plain, options


def with_brackets(name: str, options: dict[str, Any]) -> str:
    """The inverse of ``split_options``."""
    listed = ",".join(f"{key}={str(value).lower() if isinstance(value, bool) else value}" for key, value in options.items())
    return f"{name}[{listed}]" if listed else name


def resolved(name: str) -> tuple[str, dict[str, Any]]:
    """The registered name of a controller, or its file, without limits, and its options.

    Of entries that make the same controller it is the first without options, so that ``backstepping-weight`` is
    ``backstepping[weight_compensation=true]``.
    """
    plain, options = _asked(name)
    known = _known("controller")
    if plain not in known:
        return plain, options
    own = known[plain]
    alike = (one.name for one in known.values() if one.made is own.made and not one.options)
    return next(alike, plain), {**own.options, **options}


def _asked(name: str) -> tuple[str, dict[str, Any]]:
    """The name of an entry, or a file, as it is asked for, and the options that it carries."""
    plain, options = split_options(name.removeprefix(LIMITED))
    if plain.startswith(f"{RESIDUAL}:"):
        return RESIDUAL, {"policy": plain.removeprefix(f"{RESIDUAL}:"), **options}
    return plain, options


def bare_name(name: str) -> str:
    """A controller's registered name, or its file, without options and limits."""
    return resolved(name)[0]


def _part(plain: str) -> Any:
    """What makes the controller of a ``bare_name``; ``ValueError`` names what is unknown and what there is."""
    if plain.rpartition(":")[0].endswith(".py"):
        return from_file("controller", plain)
    return entry("controller", plain, OWN_FILE).made


def uses_force(name: str) -> bool:
    """Whether a controller is told the hand's force.

    A registered controller says what it needs, and a policy that comes with the package what is needed with it; the option
    ``force_sensor=false`` takes the need away. Of a user's own class the attribute ``reads_force`` counts, where it has one,
    and of a policy in a folder what it was trained with. The limits of ``limited:`` need the force.
    """
    plain, options = resolved(name)
    if name.startswith(LIMITED):
        return True
    known, policies, policy = _known("controller"), _known("policy"), options.get("policy")
    if plain not in known:
        return bool(getattr(_part(plain), "reads_force", True))
    if policy is not None and policy not in policies:
        return bool(getattr(make_controller(name), "reads_force", True))
    needs = known[plain].needs if policy is None else policies[policy].needs
    return "force sensor" in needs and bool(options.get("force_sensor", True))


def learns_mass(name: str, sampled: bool = True, parameters: Parameters | None = None) -> bool:
    """Whether a controller finds out that its rig has another mass than it believes.

    A compiled law that can do so has a number ``learns_mass`` among the constants that its kernel reads, 1 where it does; any
    other learns no mass. Options count. A policy learns it where the law that it corrects does, or the estimator that it reads.

    Parameters
    ----------
    name
        As ``make_controller`` takes it.
    sampled
        Whether positions are samples, as all sensors show them but ideal ones.
    parameters
        What it believes of the rig and its sensors.
    """
    law = make_controller(name.removeprefix(LIMITED), parameters)
    stages = law.controller_stages(sampled) if isinstance(law, StagedController) else []
    return any(_constant(stage, LEARNS_MASS) > 0.0 for stage in stages)


def _constant(stage: ControllerStage, name: str) -> float:
    """A number among the constants of a stage, by its name; zero where there is none."""
    layout, first = layouts_of(stage.function)[CONSTANTS], 0
    for own, _, _, count in layout.entries() if layout else ():
        if own.endswith(name):
            return float(stage.constants[first])
        first += count
    return 0.0


def known_options(name: str) -> list[str] | None:
    """The options of a controller, which its name may carry and ``--set`` sets; None where it takes any."""
    plain = bare_name(name)
    known = _known("controller").get(plain)
    part = _part(plain) if known is None else known.made
    if is_ready(part) or not callable(part):
        return []
    try:
        parameters = list(inspect.signature(part).parameters.values())
    except ValueError:  # a class of Python's own, or an heir of one
        return None
    named, tunable = [one.name for one in parameters if one.kind is not one.VAR_KEYWORD][1:], getattr(part, "TUNABLE", {})
    guarded = GUARDING if _makes(part, StagedController) else ()
    closed = tunable or len(named) + 1 == len(parameters)
    return [*named, *tunable, *guarded] if closed else None


def make_controller(name: str | os.PathLike[str], parameters: Parameters | None = None, **options: Any) -> Controller:
    """Make a controller by its name.

    Parameters
    ----------
    name : str or path
        One of ``birthsim.controllers()``, with options as in ``"pid[bandwidth=60]"``, or a policy's, ``"residual:circle"``;
        or what a file of your own has, ``"path/to/file.py:Name"``. ``limited:`` before it puts the controller behind the
        limits of ``PortLimiter``.
    parameters : Parameters, path, mapping or None
        What the controller assumes of the rig; None stands for the defaults.
    **options
        Of the controller, as its name carries them.

    Returns
    -------
    Controller
        An object with ``command(measurement, reference)`` and ``reset(lanes)``.

    Raises
    ------
    ValueError
        Names what is unknown and what there is, or the option, its value and what is allowed.

    Examples
    --------
    >>> import birthsim
    >>> controller = birthsim.make_controller("pid", bandwidth=60.0)
    >>> env = birthsim.make("BirthSIM/Circle-v2", policy_period=0.001)
    >>> observation, info = env.reset(seed=0)
    >>> action = controller.command(env.unwrapped.measurement, env.unwrapped.reference)
    >>> observation, reward, terminated, truncated, info = env.step(action)
    """
    if not isinstance(name, (str, os.PathLike)):
        raise ValueError(f"controller = {shown(name)}; allowed: {', '.join(names('controller'))}{OWN_FILE}")
    name, rig = os.fspath(name), load_parameters(parameters)
    plain, named = resolved(name)
    known, given = known_options(name), {**named, **options}
    for option, value in given.items():
        if known is not None and option not in known:
            allowed = ", ".join(known) or "no options"
            raise ValueError(
                f"controller = {shown(name)}: {option} = {shown(value)} is unknown{near(option, known)}; allowed for {plain}: "
                f"{allowed}"
            )
    guarding = {option: given.pop(option) for option in GUARDING if option in given}
    law = _made(_asked(name)[0], rig, given)
    whole = PortLimiter(law, rig) if name.startswith(LIMITED) else law
    if not guarding:
        return whole
    if not isinstance(whole, StagedController):
        raise ValueError(f"{', '.join(guarding)} for controller = {shown(name)}; allowed: for a controller of the package")
    return whole.protect(**guarding)


def _made(asked: str, rig: Parameters, options: dict[str, Any]) -> Controller:
    """The controller of an entry's name or of a file; ``ValueError`` names the extra that is missing."""
    part = _part(asked)
    if asked not in _known("controller"):
        return made_controller(asked, part, rig, options)
    try:
        made: Controller = controller_of(part) if is_ready(part) else part(rig, **options)
    except ImportError as error:
        extras = [need.removeprefix("extra ") for need in _known("controller")[asked].needs if need.startswith("extra ")]
        raise ValueError(f"{error}; {asked} needs {installation(*extras)}") from error
    return made
