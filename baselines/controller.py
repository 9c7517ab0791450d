"""What every controller looks like."""

import inspect
import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from birthsim_env.loop.guard import require_good
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.parts.callables import arguments_of
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.arrays import floats_of
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import is_finite, is_within, limits, problem, shown

RESIDUAL = "residual"
"""The controller with a trained policy; ``residual:circle`` names its policy."""

BEYOND = 1000.0
"""A gain may be so many times below the lowest, or above the highest, that tuning tries."""


class Controller(Protocol):
    """What every controller is: an object with these two methods, called once per control period.

    Notes
    -----
    ``command(measurement, reference)`` takes what the sensors say and what is asked for, a ``Measurement`` and a ``Reference``,
    and returns spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N) for signals over N lanes, (4,) for
    one rig. ``reset(lanes=None)`` forgets the past, of all lanes or of those where the mask (N,) is True. A controller never
    gets an environment.

    Examples
    --------
    A controller of your own needs no base class:

    >>> import numpy as np, birthsim
    >>> class Shut:
    ...     def command(self, measurement, reference):
    ...         return np.zeros_like(measurement.pressures)
    ...     def reset(self, lanes=None):
    ...         pass
    >>> found = birthsim.evaluate("BirthSIM/Probe-v3", Shut(), episodes=2, duration=1.0, progress=False)
    >>> len(found.metrics["error_rms_x"])
    2
    """

    def command(self, measurement: Measurement, reference: Reference) -> Array: ...

    def reset(self, lanes: Mask | None = None) -> None: ...


@runtime_checkable
class Remarking(Protocol):
    """A controller that has something to say of the control so far, which an evaluation prints."""

    def remarks(self) -> list[str]: ...


@runtime_checkable
class Deciding(Protocol):
    """A controller that decides once in ``held_periods`` control periods; ``command`` holds what ``decide`` has opened.

    What knows that asks ``decide`` itself, so that the closed loop need not stop in between.
    """

    held_periods: int

    def decide(self, measurement: Measurement, reference: Reference) -> Array: ...


CommandFunction = Callable[[Measurement, Reference], Array]
"""A function as a control law: openings as ``Controller.command`` returns them."""


ALLOWED = (
    "an object with command(measurement, reference) and reset(), a function law(measurement, reference), or a class or "
    "function that makes one of the rig (birthsim_env.Parameters)"
)


class PlainController:
    """A user's function of measurement and reference as a controller, which remembers nothing."""

    def __init__(self, function: CommandFunction) -> None:
        self.command = function

    def reset(self, lanes: Mask | None = None) -> None:
        """There is nothing to forget."""


class WholeReset:
    """A user's controller whose ``reset()`` knows no lanes: it is called where all of them begin."""

    def __init__(self, controller: Any) -> None:
        self.controller, self.command = controller, controller.command

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes; some lanes cannot be forgotten alone."""
        if lanes is None:
            self.controller.reset()


def _is_controller(part: Any) -> bool:
    return not inspect.isclass(part) and callable(getattr(part, "command", None)) and callable(getattr(part, "reset", None))


def is_ready(part: Any) -> bool:
    """Whether a user's part is a controller or a law, rather than what makes one of a rig.

    A law needs both signals. A function that needs one argument makes a controller, whatever else it takes."""
    if _is_controller(part):
        return True
    if inspect.isclass(part) or not callable(part):
        return False
    takes = arguments_of(part)
    return takes.take(2) and (takes.needed != 1 or takes.most == math.inf or takes.names[:2] == ("measurement", "reference"))


def controller_of(part: Any) -> Controller:
    """A user's controller as it is, or a function of measurement and reference as one; ``ValueError`` for anything else."""
    if inspect.isclass(part):
        raise ValueError(f"controller = {part.__name__}, a class; allowed: an object of it, {part.__name__}(...)")
    if _is_controller(part):
        made: Controller = part if arguments_of(part.reset).take(1) else WholeReset(part)
        return made
    if callable(part) and arguments_of(part).take(2):
        return PlainController(part)
    raise ValueError(f"controller = {shown(part)}; allowed: {ALLOWED}, which is called first")


def made_controller(name: str, part: Any, rig: Parameters, options: Mapping[str, Any]) -> Controller:
    """The controller that a user's ``part`` is, or makes of the ``rig`` and ``options``; ``name`` is for errors.

    Raises ``ValueError`` in one line."""
    if is_ready(part):
        return controller_of(part)
    if not callable(part):
        raise ValueError(f"controller = {shown(name)} is {shown(part)}; allowed: {ALLOWED}")
    try:
        made = part(rig, **options) if arguments_of(part).most else part(**options)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # it may also end Python
        raise ValueError(f"controller = {shown(name)} cannot be made ({problem(error)}); allowed: {ALLOWED}") from error
    if not is_ready(made):
        said = "without command() or reset()" if inspect.isclass(part) else f"as {shown(made)}"
        raise ValueError(f"controller = {shown(name)} is made {said}; allowed: {ALLOWED}")
    return controller_of(made)


def checked_command(name: str, command: Any, lanes: int) -> Array:
    """Spool openings (4, ``lanes``) that the controller ``name`` returned; ``ValueError`` in one line for anything else."""
    expected = f"allowed: spool openings of chambers P1, N1, P2, N2 of {lanes} lanes, an array (4, {lanes}) in [-1, 1]"
    try:
        array = floats_of(command)
    except ValueError as error:
        raise ValueError(f"controller {name!r}: command() returned {shown(command)}: {error}; {expected}") from None
    if array.shape != (4, lanes):
        raise ValueError(f"controller {name!r}: command() returned an array {array.shape}; {expected}")
    if not np.abs(array).max() <= 1.0:
        row, lane = (int(k) for k in np.argwhere(~(np.abs(array) <= 1.0))[0])
        raise ValueError(f"controller {name!r}: command()[{row}, {lane}] = {array[row, lane]}; {expected}")
    return array


class Tunable(Protocol):
    """A controller whose gains ``birthsim tune`` finds: ``TUNABLE`` is gain -> (lowest, highest) to try, SI units."""

    TUNABLE: ClassVar[dict[str, tuple[float, float]]]


def checked_gains(controller: Tunable, gains: Mapping[str, float]) -> dict[str, float]:
    """``gains`` as floats; raises ``ValueError`` for gains that the controller has not, and for those that are not positive
    (or zero where the lowest to try is)."""
    known = controller.TUNABLE
    for name, value in gains.items():
        if name not in known:
            raise ValueError(f"{name} = {shown(value)} is no gain of {type(controller).__name__}; allowed: {', '.join(known)}")
        low, high = known[name]
        least, most = low / BEYOND, high * BEYOND
        if not is_within(value, least=least, most=most):
            words = (
                f"zero or a positive number{limits(most=most)}"
                if low == 0
                else f"a positive number{limits(least=least, most=most)}"
            )
            raise ValueError(f"{name} = {shown(value)}; allowed: {words}")
    return {name: float(value) for name, value in gains.items()}


def check_flags(flags: Mapping[str, object]) -> None:
    """Raises ``ValueError`` for a value that is neither True nor False, nor 1 or 0."""
    for name, flag in flags.items():
        if not (isinstance(flag, (bool, np.bool_)) or (is_finite(flag) and flag in (0, 1))):
            raise ValueError(f"{name} = {shown(flag)}; allowed: True or False")


def require_stiffness(reference: Reference, least: float) -> None:
    """Raises ``ValueError`` for a setpoint [[Kclx, Kclxy], [Kclxy, Kcly]] that somewhere is not stiffer than ``least``, N/m."""
    require_good(reference)
    (kx, ky), kxy = reference.stiffness, reference.stiffness_coupling
    softest = 0.5 * (kx + ky) - np.hypot(0.5 * (kx - ky), kxy)
    if (softest <= least).any():
        lane = int(np.argmax(softest <= least))
        raise ValueError(
            f"stiffness setpoint [[{kx[lane]:g}, {kxy[lane]:g}], [{kxy[lane]:g}, {ky[lane]:g}]] N/m in lane {lane}; "
            f"allowed: more than {least:.3g} N/m in every direction"
        )
