"""What connects a rig: the protocol that every driver follows, and drivers by their names."""

from collections.abc import Callable
from typing import Any, Protocol, cast

from birthsim_env.loop.signals import Measurement
from birthsim_env.parts.own_parts import from_file
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import problem, shown
from birthsim_env.registry import entry


class Driver(Protocol):
    """What every driver is: an object with these three methods, which a control loop calls once per control period.

    Notes
    -----
    ``read()`` waits for the rig's next sample and returns it as a ``Measurement`` of one rig, without lanes: ``position`` (2,),
    m, ``pressures`` (4,), Pa, absolute, and so on, each float64; a signal that no sensor measures, or whose sensor fails, is
    NaN. It raises ``TimeoutError`` where no sample comes within a few control periods. The rig's clock paces the loop. A driver
    whose hardware is polled calls ``Pace.wait`` first, which waits for the computer's clock instead.

    ``write(openings)`` sets the valves of chambers P1, N1, P2, N2, (4,), from -1, to the exhaust, to 1, to the supply, and
    returns at once. ``stop()`` makes the rig safe and lets go of it: it closes the valves, or does what the wiring offers, such
    as to switch off the supply. It is called in the end whatever happened, possibly twice, and by another process where the
    first one was killed; so it must work on a driver that was just made.

    Examples
    --------
    A rig that stands still, whose driver counts what it is asked to do:

    >>> import numpy as np, birthsim
    >>> class Still:
    ...     time, written = 0.0, 0
    ...     def read(self):
    ...         self.time += 0.001
    ...         place, still = np.array([0.5, 0.0]), np.zeros(2)
    ...         pressures = np.full(4, 4e5)
    ...         return birthsim.Measurement(np.array(self.time), place, np.array(self.time), still, pressures, still, True)
    ...     def write(self, openings):
    ...         self.written += 1
    ...     def stop(self):
    ...         pass
    >>> Still().read().pressures.tolist()
    [400000.0, 400000.0, 400000.0, 400000.0]
    """

    def read(self) -> Measurement: ...

    def write(self, openings: Array) -> None: ...

    def stop(self) -> None: ...


Maker = Callable[[Parameters, str], Driver]
"""Makes a driver for a rig, and of what stands behind its name: ``udp:192.168.0.5:5005`` has the address."""

METHODS = ("read", "write", "stop")


def make_driver(name: str, rig: Parameters) -> Driver:
    """The driver ``name``: a registered one, with what it connects to behind a colon, or path/to/file.py:Class.

    A class of your own is called with the rig, and connects where it is made. Raises ``ValueError`` that says what is allowed.
    """
    if name.rpartition(":")[0].endswith(".py"):
        return _own_driver(name, rig)
    kind, _, place = name.partition(":")
    made: Maker = entry("driver", kind, ", or path/to/file.py:Class").made
    try:
        return made(rig, place)
    except OSError as error:
        raise ValueError(f"driver = {shown(name)}: {error.strerror or error}; allowed: a rig that can be reached") from error


def _own_driver(name: str, rig: Parameters) -> Driver:
    part: Any = from_file("driver", name)
    allowed = f"allowed: a class with {', '.join(f'{method}()' for method in METHODS)}, which is called with the rig"
    try:
        made = part(rig)
    except KeyboardInterrupt:
        raise
    except Exception as error:
        raise ValueError(f"driver = {shown(name)} cannot be made ({problem(error)}); {allowed}") from error
    lacks = [method for method in METHODS if not callable(getattr(made, method, None))]
    if lacks:
        raise ValueError(f"driver = {shown(name)} lacks {', '.join(lacks)}; {allowed}")
    return cast(Driver, made)
