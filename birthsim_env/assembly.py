"""Builds the simulation of an environment from the arguments of ``gym.make``, refusing what cannot be."""

import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict, TypeVar, Unpack

import numpy as np
from gymnasium import spaces

from birthsim_env import observation
from birthsim_env.drawing.scene import checked_size
from birthsim_env.loop.loop import available_threads
from birthsim_env.loop.rows import MOST_ACTIONS, MOST_SHOWN
from birthsim_env.parts.actuation import ACTUATIONS, VALVE_LAYOUTS, Actuation
from birthsim_env.parts.courses import check_drawn, check_points
from birthsim_env.parts.drawn.randomization import RANDOMIZE, checked_ranges, ranges_of
from birthsim_env.parts.own_parts import hand_of, stiffness_of, trajectory_of
from birthsim_env.parts.scenarios import Scenario, find_scenario, rig_of
from birthsim_env.parts.sensors.model import drawn_by, models_that_draw
from birthsim_env.parts.times import called, check_times
from birthsim_env.physics.rig.arrays import floats_of
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import is_within, near, path_of, shown, whole_of
from birthsim_env.registry import entry, names
from birthsim_env.simulation import Simulation

F = TypeVar("F", bound=Callable[..., Any])
Randomize = bool | str | Mapping[str, tuple[float, float]]
RENDER_MODES = ("human", "rgb_array")
GIVEN = ("reference", "user_force", "stiffness")
PARTS = ("trajectory", "user_force", "stiffness")
"""The arguments by which a user gives parts of a scenario, and what a simulation calls these parts."""


class Arguments(TypedDict, total=False):
    """The arguments of ``gym.make``; ``BirthSIMEnv`` says what they mean."""

    action_mode: str
    valves: str
    sensors: str
    randomize: Randomize
    reference: Any
    user_force: Any
    stiffness: Any
    parameters: Parameters | Mapping[str, Any] | str | Path | None
    policy_period: float
    duration: float | None
    actuation: Actuation | None
    picture_size: tuple[int, int]
    num_threads: int | None
    force_sensor: bool
    clip_actions: bool


DEFAULTS: Arguments = {
    "action_mode": "valve", "valves": "two_valves", "sensors": "ideal", "randomize": False, "reference": None,
    "user_force": None, "stiffness": None, "parameters": None, "policy_period": 0.01, "duration": None, "actuation": None,
    "picture_size": (640, 480), "num_threads": None, "force_sensor": True, "clip_actions": False,
}  # fmt: skip


def spelled_out(*less: str) -> Callable[[F], F]:
    """Gives a function with ``**arguments: Unpack[Arguments]`` a signature that names them all, but for those in ``less``."""

    def decorate(function: F) -> F:
        signature = inspect.signature(function)
        own = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
        more = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Arguments.__annotations__[name])
            for name, default in DEFAULTS.items()
            if name not in less
        ]
        function.__signature__ = signature.replace(parameters=[*own, *more])  # type: ignore[attr-defined]
        return function

    return decorate


LONGEST, LONGEST_PERIOD = 3600.0, 1.0
"""s: the longest episode, and the longest time for which an action is held."""

MOST_THREADS = 1024
"""Threads of an environment."""

ROUNDING = 2.0**-20
"""So far beyond 1 an action still counts as 1: eight units in the last place of a single, as rounding may leave them."""


def one_of(name: str, value: Any, allowed: tuple[Any, ...]) -> Any:
    """``value`` if it is allowed, else a ``ValueError`` that lists what is."""
    value = bool(value) if isinstance(value, np.bool_) else value
    if not any(value is option or (isinstance(value, str) and value == option) for option in allowed):
        like = near(value, [option for option in allowed if isinstance(option, str)]) if isinstance(value, str) else ""
        raise ValueError(f"{name} = {shown(value)}{like}; allowed: {', '.join(repr(option) for option in allowed)}")
    return value


def policy_periods(policy_period: float, parameters: Parameters) -> int:
    """Control periods in a policy period, which must be a whole number of them."""
    control = parameters.electronics.control_period
    periods = round(policy_period / control) if is_within(policy_period, above=0.0, most=LONGEST_PERIOD) else 0
    # Within 1e-9 s, or as near as a number of single precision is.
    if periods < 1 or abs(periods * control - policy_period) > max(1e-9, 1e-7 * policy_period):
        raise ValueError(
            f"policy_period = {shown(policy_period)} s; allowed: a multiple of the control period {control:g} s up to "
            f"{LONGEST_PERIOD:g} s"
        )
    return periods


@dataclass(frozen=True)
class Experiment:
    """What episodes are drawn from: a ``scenario`` on a ``rig`` that ``sensors`` measure, with what a user has ``given`` in
    place of its parts. They last ``duration`` s, which may be ``usual`` for the scenario.

    ``randomize`` is what the environment was made with. Errors are those of ``assemble``.
    """

    scenario: Scenario
    rig: Parameters
    sensors: str
    duration: float
    usual: bool
    given: Mapping[str, Any]
    randomize: Any

    def drawn(self, randomize: Any) -> tuple[dict[str, tuple[Any, ...]], bool]:
        """What is drawn of the rig and its sensors, and whether the parts of the scenario are ``varied`` too."""
        if isinstance(randomize, Mapping):
            return checked_ranges(randomize, self.rig, self.sensors), False
        one_of("randomize", randomize, RANDOMIZE)
        ranges = checked_ranges(ranges_of(self.rig, randomize, self.sensors), self.rig, self.sensors)
        if randomize == "sensors" and not drawn_by(self.sensors):
            able = ", ".join(map(repr, models_that_draw()))
            raise ValueError(f"randomize = 'sensors' with sensors = {self.sensors!r}; allowed: with sensors = {able}")
        return ranges, randomize in (True, "scenario", "sensors")

    def parts(self, varied: bool, changing: bool = False) -> dict[str, Any]:
        """Target, hand and setpoints, by their names in a simulation; where they are ``changing``, without a user's own."""
        reference, user_force, stiffness = given = tuple(self.given[name] for name in GIVEN)
        own: dict[str, Any] = dict(zip(PARTS, (self.scenario.varied if varied else self.scenario.nominal)(), strict=True))
        if changing:
            named_hand = path_of(user_force) in names("hand")
            own = {name: own[name] for name, one in zip(PARTS, given, strict=True) if one is None}
            own |= {"user_force": hand_of(user_force, varied)} if named_hand else {}
        else:
            own["trajectory"] = own["trajectory"] if reference is None else trajectory_of(reference, self.duration)
            own["user_force"] = own["user_force"] if user_force is None else hand_of(user_force, varied)
            own["stiffness"] = own["stiffness"] if stiffness is None else stiffness_of(stiffness)
            for name, one, part in zip(GIVEN, given, own.values(), strict=True):
                check_times(name, one, part.timed, self.duration, self.usual)
            check_points(called("reference", reference), own["trajectory"], self.duration, self.rig)
        if "trajectory" in own:
            check_drawn(own["trajectory"], self.duration, self.rig)
        return own


@dataclass(frozen=True)
class Setup:
    """What an environment is made of."""

    experiment: Experiment
    simulation: Simulation
    actuation: Actuation
    duration: float
    policy_period: float
    clip_actions: bool
    title: str
    picture_size: tuple[int, int]
    single_observation_space: spaces.Box
    single_action_space: spaces.Box
    observation_names: tuple[str, ...]

    @property
    def frames_per_second(self) -> int:
        """Rate at which a frame per policy step shows real time, rounded: recorders and players take whole numbers."""
        return max(1, round(1 / self.policy_period))

    @property
    def steps(self) -> int:
        """Policy steps until the scenario ends."""
        return max(1, round(self.duration / self.policy_period))


def assemble(num_envs: int, scenario: str, **arguments: Unpack[Arguments]) -> Setup:
    """See ``BirthSIMEnv`` for the arguments; raises ``ValueError`` naming the argument, its value and what is allowed, and
    ``TypeError`` for arguments that there are not."""
    refuse_unknown(arguments)
    given: Arguments = {**DEFAULTS, **arguments}
    actuation, duration = given["actuation"], given["duration"]
    rig = rig_of(scenario, given["parameters"])
    table = find_scenario(scenario).on(rig)
    valves = one_of("valves", given["valves"], VALVE_LAYOUTS)
    sensors = entry("sensors", given["sensors"]).name
    one_of("force_sensor", given["force_sensor"], (True, False))
    one_of("clip_actions", given["clip_actions"], (True, False))
    if not isinstance(actuation, Actuation | None):
        raise ValueError(f"actuation = {shown(actuation)}; allowed: None or an object of a class derived from Actuation")
    chosen = actuation or ACTUATIONS[one_of("action_mode", given["action_mode"], tuple(ACTUATIONS))](
        valves, rig.linkage.topology
    )
    for name, length, most in (("size", chosen.size, MOST_ACTIONS), ("memory_names", len(chosen.memory_names), MOST_SHOWN)):
        if not length <= most:
            raise ValueError(f"actuation.{name} has a length of {length}; allowed: at most {most}")
    if duration is not None and not is_within(duration, above=0.0, most=LONGEST):
        raise ValueError(f"duration = {shown(duration)}; allowed: None or a positive number, at most {LONGEST:g} (s)")
    lasts, own = float(duration or table.duration), {name: given[name] for name in GIVEN}  # type: ignore[literal-required]
    experiment = Experiment(table, rig, sensors, lasts, duration is None, own, given["randomize"])
    ranges, varied = experiment.drawn(given["randomize"])
    periods, threads = policy_periods(given["policy_period"], rig), threads_for(num_envs, given["num_threads"])
    trajectory, hand, stiffness = experiment.parts(varied).values()
    parts = trajectory, hand, stiffness, sensors, chosen
    simulation = Simulation(num_envs, rig, ranges, *parts, periods, threads, given["force_sensor"])
    limit = observation.LIMIT
    entries = (*map(str, observation.entries_of(rig)), *(f"last action: {name}" for name in chosen.names), *chosen.memory_names)
    seen, acted = spaces.Box(-limit, limit, (len(entries),), np.float32), spaces.Box(-1.0, 1.0, (chosen.size,), np.float32)
    size = checked_size("picture_size", given["picture_size"])
    how = lasts, float(given["policy_period"]), given["clip_actions"], table.title, size
    return Setup(experiment, simulation, chosen, *how, seen, acted, entries)


def threads_for(num_envs: int, num_threads: int | None) -> int:
    """``num_threads`` if that is a whole number of at least 1; for None, one for one lane and else all that there are."""
    if num_threads is None:
        return available_threads() if num_envs > 1 else 1
    threads = whole_of(num_threads)
    if threads is None or not 1 <= threads <= MOST_THREADS:
        raise ValueError(f"num_threads = {shown(num_threads)}; allowed: None or a whole number >= 1 and <= {MOST_THREADS}")
    return threads


def refuse_unknown(unknown: Iterable[str], more: Sequence[str] = (), less: Sequence[str] = ()) -> None:
    """Raise ``TypeError``, as Python does, for names that are none of ``Arguments``; ``more`` and ``less`` than these are
    allowed in a derived environment."""
    known = [*more, *(name for name in DEFAULTS if name not in less), "render_mode"]
    wrong = [name for name in unknown if name not in known]
    if wrong:
        # In Python's words: TorchRL, for one, looks for them.
        said = ", ".join(f"{name!r}{near(name, known)}" for name in wrong)
        raise TypeError(f"got an unexpected keyword argument {said}; allowed: {', '.join(known)}")


def checked_actions(actions: Any, num_envs: int, size: int, clip: bool, arrays: Any = np) -> Any:
    """Actions (num_envs, size) as contiguous (size, num_envs), or a ``ValueError`` that names what is wrong.

    Finite numbers beyond [-1, 1] are clipped where ``clip`` says so. ``arrays`` is NumPy, or the module like it of the arrays
    that are wanted.
    """
    try:
        array = floats_of(actions, arrays)
    except ValueError as error:
        raise ValueError(f"action = {shown(actions)}: {error}; allowed: {size} numbers in [-1, 1]") from error
    if array.shape != (num_envs, size):
        shape = (size,) if num_envs == 1 else (num_envs, size)
        given = array.shape[1:] if num_envs == 1 and array.ndim > 0 else array.shape
        raise ValueError(f"action has shape {given}; allowed: {shape}, in [-1, 1]")
    # A copy even where the layout would allow a view: the caller may use one array for all of its actions.
    columns = arrays.array(array.T, order="C")
    extreme = float(abs(columns).max()) if columns.size else 0.0
    if extreme <= 1.0:
        return columns
    if not (extreme <= 1.0 + ROUNDING or (clip and math.isfinite(extreme))):
        lane, entry = (int(k) for k in arrays.argwhere(~(abs(array) <= 1.0 + ROUNDING))[0])
        clips = "" if clip else ", or any with clip_actions=True or gymnasium.wrappers.ClipAction"
        raise ValueError(f"action[{entry}] = {array[lane, entry]} in lane {lane}; allowed: -1 to 1{clips}")
    return arrays.clip(columns, -1.0, 1.0)
