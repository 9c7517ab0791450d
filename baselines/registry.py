"""Controllers by name: the table, other packages' entry points, and a user's own file.

A factory takes the rig as its owner describes it, and keyword options, and returns a ``Controller``.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from traceback import extract_tb
from typing import Any

from baselines.admittance_backstepping import AdmittanceBackstepping
from baselines.backstepping import BacksteppingController
from baselines.cartesian_backstepping import CartesianBackstepping
from baselines.controller import Controller
from baselines.rivals import LinearQuadratic, NonlinearMPC, PositionPID, SlidingMode
from birthsim_env.parameters import Parameters

Factory = Callable[..., Controller]

ENTRY_POINTS = "birthsim.controllers"
"""Entry point group by which a package that builds on this one adds controllers."""


def _backstepping(parameters: Parameters) -> Controller:
    return BacksteppingController(parameters)


def _backstepping_weight(parameters: Parameters) -> Controller:
    return BacksteppingController(parameters, weight_compensation=True)


CONTROLLERS: dict[str, Factory] = {
    "backstepping": _backstepping,
    "backstepping-weight": _backstepping_weight,
    "backstepping-frozen": partial(BacksteppingController, weight_compensation=True, frozen_friction=True),
    "backstepping-one-valve": partial(BacksteppingController, weight_compensation=True, valves="one_valve"),
    "backstepping-force-first": partial(BacksteppingController, force_first=True),
    "backstepping-cartesian": CartesianBackstepping,
    "admittance-backstepping": AdmittanceBackstepping,
    "pid": PositionPID,
    "lqr": LinearQuadratic,
    "sliding-mode": SlidingMode,
    "nonlinear-mpc": NonlinearMPC,
}

SLOW = frozenset({"nonlinear-mpc"})
"""Controllers far from real time, which ``birthsim-evaluate --all`` leaves out unless they are named."""


def controller_names() -> list[str]:
    """Every name that ``make_controller`` knows."""
    return [*CONTROLLERS, *(point.name for point in entry_points(group=ENTRY_POINTS))]


def make_controller(name: str, parameters: Parameters, **options: Any) -> Controller:
    """The controller ``name``, or the class of a user's own file given as ``path/to/file.py:Class``.

    Raises ``ValueError`` naming what is unknown and what there is.
    """
    if name in CONTROLLERS:
        return CONTROLLERS[name](parameters, **options)
    for point in entry_points(group=ENTRY_POINTS):
        if point.name == name:
            made: Controller = point.load()(parameters, **options)
            return made
    path, _, attribute = name.rpartition(":")
    if path.endswith(".py"):
        return _own(name, _from_file(Path(path), attribute), parameters, options)
    raise ValueError(f"controller = {name!r}; allowed: {', '.join(controller_names())}, or path/to/file.py:Class")


def _own(name: str, factory: Any, parameters: Parameters, options: dict[str, Any]) -> Controller:
    """A controller of a user's own class; raises ``ValueError`` naming what it lacks, in one line."""
    expected = "allowed: a class that takes the rig (birthsim_env.Parameters), with command(measurement, reference) and reset()"
    try:
        own = factory(parameters, **options)
    except Exception as error:
        raise ValueError(f"controller = {name!r} cannot be made ({type(error).__name__}: {error}); {expected}") from error
    if not (callable(getattr(own, "command", None)) and callable(getattr(own, "reset", None))):
        raise ValueError(f"controller = {name!r} is made without command() or reset(); {expected}")
    made: Controller = own
    return made


def _from_file(path: Path, attribute: str) -> Factory:
    # No package has a path for a name, whatever the file is called.
    spec = importlib.util.spec_from_file_location(str(path.resolve()), path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise ValueError(f"controller file {str(path)!r} does not exist; allowed: path/to/file.py:Class")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look their annotations up
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[spec.name]
        line = next((frame.lineno for frame in reversed(extract_tb(error.__traceback__)) if frame.filename == str(path)), None)
        place = "" if line is None else f", line {line}"
        problem = f"{type(error).__name__}: {error}"
        raise ValueError(f"controller file {str(path)!r}{place}: {problem}; allowed: a file that Python imports") from error
    if not hasattr(module, attribute):
        raise ValueError(f"controller file {str(path)!r} has no {attribute!r}; allowed: a class with command() and reset()")
    factory: Factory = getattr(module, attribute)
    return factory
