"""Parts of a user's own: classes and functions in Python files, plain functions of time, and CSV files."""

import importlib.util
import inspect
import os
import sys
from collections.abc import Callable
from pathlib import Path
from traceback import extract_tb
from typing import Any

import numpy as np

from birthsim_env.parts.callables import arguments_of
from birthsim_env.parts.hands.user_forces import ForceProfile, UserForce
from birthsim_env.parts.points import Sampled, Through
from birthsim_env.parts.references import LONGEST, Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.parts.times import timed
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.arrays import floats_of
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.values import is_finite, path_of, problem, shown
from birthsim_env.registry import entry, names
from birthsim_env.tables.columns import columns, table_file

COURSE = {"time": "s", "x": "m", "y": "m", "stiffness": "N/m"}
FORCE = {"time": "s", "Fx": "N", "Fy": "N"}
"""Columns of a user's tables, with their units."""


def from_file(kind: str, text: str) -> Any:
    """What ``path/to/file.py:Name`` names; ``kind`` ("controller", ...) is for the errors.

    Raises ``ValueError`` in one line for a file that is missing, that Python does not import or that has no such name.
    """
    place, _, attribute = text.rpartition(":")
    path = Path(place)
    if not os.path.isfile(path):
        raise ValueError(f"{kind} file {named(path)} does not exist; allowed: path/to/file.py:Name")
    # No package has a path for a name, whatever the file is called; what stands before a dot would be a package, to pickle.
    spec = importlib.util.spec_from_file_location(str(path.resolve()).replace(".", "_"), path)
    if spec is None or spec.loader is None:
        raise ValueError(f"{kind} file {named(path)} is no Python; allowed: path/to/file.py:Name")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look their annotations up
    try:
        spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a file may also end Python
        sys.modules.pop(spec.name, None)
        line = next((frame.lineno for frame in reversed(extract_tb(error.__traceback__)) if frame.filename == str(path)), None)
        where = "" if line is None else f", line {line}"
        raise ValueError(f"{kind} file {str(path)!r}{where}: {problem(error)}; allowed: a file that Python imports") from error
    if not hasattr(module, attribute):
        names = [name for name in vars(module) if not name.startswith("_")]
        raise ValueError(
            f"{kind} file {str(path)!r} has no {attribute!r}; allowed: a name that it defines: {', '.join(names)[:400]}"
        )
    return getattr(module, attribute)


STEPPED = 250.0
"""N/m: a stiffness that differs by so much from the present setpoint becomes the next one; assumed, a twelfth of 3000 N/m."""


def stepped(times: Array, stiffness: Array) -> StiffnessSchedule:
    """Setpoints in steps of ``STEPPED`` or more that follow ``stiffness`` (M,), N/m, at ``times`` (M,), s.

    Rows before 0 and after ``LONGEST`` set nothing but what is asked for at 0. A step restarts the count of settled time, as
    where a user changes the setpoint. The pneumatic stiffness stays at 4200 and
    2100 N/m, as in ``BirthSIM/Descent-v2``.
    """
    chosen = [0]
    for k, value in enumerate(stiffness):
        if abs(value - stiffness[chosen[-1]]) >= STEPPED:
            chosen.append(k)
    begun = [k for k, following in zip(chosen, [*chosen[1:], None], strict=True) if following is None or times[following] > 0.0]
    chosen = [begun[0], *(k for k in begun[1:] if times[k] <= LONGEST)]
    starts = (0.0, *(float(times[k]) for k in chosen[1:]))
    setpoints = tuple(float(stiffness[k]) for k in chosen)
    schedule = StiffnessSchedule(starts, setpoints, (4200.0,) * len(chosen), (2100.0,) * len(chosen))
    schedule.timed = timed(times, stiffness[:, None])
    return schedule


def _called(kind: str, call: str, function: Callable[..., Any], arguments: tuple[Any, ...], expected: str) -> Array:
    """Two finite numbers that a user's function returns."""
    try:
        value = function(*arguments)
    except Exception as error:
        raise ValueError(f"{kind}: {call} fails ({problem(error)}); allowed: {expected}") from error
    try:
        return checked(call, floats_of(value).ravel(), (2,), "SI")
    except ValueError as error:
        raise ValueError(f"{kind}: {call} = {shown(value)} ({error}); allowed: {expected}") from error


class PlainHand(UserForce):
    """A user's function as a hand: of time, or of time, position and velocity, of one lane."""

    EXPECTED = "a function of time (s), or of time, position (2,) and velocity (2,), that returns (Fx, Fy) in N"

    def __init__(self, function: Callable[..., Any]) -> None:
        takes = arguments_of(function)
        felt = takes.take(3) and takes.needed != 1  # what takes any number of arguments gets all that there are
        if not (felt or takes.take(1)):
            keywords = f" and {', '.join(takes.keywords)}" if takes.keywords else ""
            raise ValueError(f"user_force: a function of {takes.needed} arguments{keywords}; allowed: {self.EXPECTED}")
        self._function, self.closed_loop = function, felt

    def force(self, time: Array, position: Array, velocity: Array) -> Array:
        forces = np.empty((time.shape[0], 2, time.shape[1]))
        for k, i in np.ndindex(*time.shape):
            t = float(time[k, i])
            given = (t, position[:, i].copy(), velocity[:, i].copy()) if self.closed_loop else (t,)
            forces[k, :, i] = _called("user_force", f"function({t:g}, ...)", self._function, given, self.EXPECTED)
        return forces


def _made(kind: str, part: Any, base: type, expected: str) -> Any:
    """A ``base`` or a function: what a user gave, or named as file.py:Name; of a class an instance."""
    path = path_of(part)
    if path is not None:
        if ".py:" not in path:
            raise ValueError(f"{kind} = {shown(path)}; allowed: {expected}")
        part = from_file(kind, path)
    if inspect.isclass(part):
        try:
            part = part()
        except Exception as error:
            raise ValueError(f"{kind}: {part.__name__}() fails ({problem(error)}); allowed: {expected}") from error
    if not (isinstance(part, base) or callable(part)):
        raise ValueError(f"{kind} = {shown(part)}; allowed: None, {expected}")
    return part


def trajectory_of(reference: Any, duration: float) -> Trajectory:
    """What the environments' argument ``reference`` says, as a ``Trajectory``; a function of time is asked for ``duration`` s.

    Raises ``ValueError`` in one line for what is none of the kinds that ``BirthSIMEnv`` lists.
    """
    expected = "a birthsim_env.Trajectory, a function of time (s) that returns (x, y) in m, file.csv or file.py:Name"
    if file := table_file(reference):
        rows = columns("reference", file, COURSE, ("time", "x", "y"))
        try:
            return Through(rows[:, 0], rows[:, 1:], duration)
        except ValueError as error:
            raise ValueError(f"reference = {str(file[0])!r}: {error}") from error
    reference = _made("reference", reference, Trajectory, expected)
    if isinstance(reference, Trajectory):
        return reference
    wanted = "a function of time (s) that returns (x, y) in m"
    return Sampled(lambda time: _called("reference", f"function({time:g})", reference, (time,), wanted), duration)


def stiffness_of(stiffness: Any) -> StiffnessSchedule:
    """What the environments' argument ``stiffness`` says, as a ``StiffnessSchedule``.

    Raises ``ValueError`` in one line for what is none of these: such a schedule, a number (N/m, of both axes for all time), a
    CSV file of time, x, y, stiffness.
    """
    if file := table_file(stiffness):
        rows = columns("stiffness", file, COURSE, ("time", "stiffness"))
        return stepped(rows[:, 0], rows[:, 1])
    if is_finite(stiffness):
        return StiffnessSchedule(closed_loop=(float(stiffness),))
    if not isinstance(stiffness, StiffnessSchedule):
        raise ValueError(
            f"stiffness = {shown(stiffness)}; allowed: None, a number (N/m), a birthsim_env.StiffnessSchedule, or file.csv of "
            "time, x, y, stiffness"
        )
    return stiffness


def hand_of(user_force: Any, varied: bool) -> UserForce:
    """What the environments' argument ``user_force`` says, as a ``UserForce``; a named one is ``varied`` from episode to
    episode or not.

    Raises ``ValueError`` in one line for what is none of the kinds that ``BirthSIMEnv`` lists.
    """
    known, path = names("hand"), path_of(user_force)
    expected = f"a birthsim_env.UserForce, {', '.join(map(repr, known))}, {PlainHand.EXPECTED}, file.csv or file.py:Name"
    if path in known:
        kind: type[UserForce] = entry("hand", path).made
        return kind.varied() if varied else kind()
    if file := table_file(user_force):
        rows = columns("user_force", file, FORCE, tuple(FORCE))
        return ForceProfile([(float(t), float(x), float(y)) for t, x, y in rows])
    user_force = _made("user_force", user_force, UserForce, expected)
    return user_force if isinstance(user_force, UserForce) else PlainHand(user_force)
