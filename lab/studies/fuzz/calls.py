"""Kinds of calls: environments, parts, controllers, parameters and settings, made with odd arguments."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import Rng, strange

CIRCLE, STEPS = "BirthSIM/Circle-v1", 4

GOOD: dict[str, tuple[Any, ...]] = {
    "action_mode": ("valve", "flow"),
    "valves": ("two_valves", "one_valve"),
    "sensors": ("ideal", "lab"),
    "randomize": (False, True, "plant", "scenario", "sensors", {"mechanics.mass": (2, 5)}),
    "reference": (None,),
    "user_force": (None, "steps", "sine", "noise", "guided"),
    "stiffness": (None,),
    "parameters": (None,),
    "policy_period": (0.01, 0.002, 0.1),
    "duration": (None, 0.5, 30.0),
    "actuation": (None,),
    "picture_size": ((640, 480), (64, 64)),
    "num_threads": (None, 1, 2),
    "render_mode": (None, "rgb_array"),
}
VECTOR: dict[str, tuple[Any, ...]] = {
    "num_envs": (1, 3), "max_episode_steps": (None, 3), "autoreset_mode": ("NextStep", "SameStep", "Disabled"),
}  # fmt: skip
RESET: dict[str, tuple[Any, ...]] = {
    "seed": (0, None), "position": ((0.5, 0.0),), "reset_mask": (None,), "staggered": (True, False),
}  # fmt: skip


def _said(value: Any) -> str:
    try:
        return repr(value)[:200]
    except (ValueError, RecursionError) as error:
        return f"{type(value).__name__} ({error})"


def _drawn(rng: Rng, table: dict[str, tuple[Any, ...]], chance: float) -> dict[str, Any]:
    """Some arguments of a table, of which about one is odd."""
    chosen = [name for name in table if rng.random() < chance]
    odd = chosen[rng.integers(len(chosen))] if chosen and rng.random() < 0.7 else ""
    return {
        name: strange(rng, table[name][0] if isinstance(table[name][0], float) else None)
        if name == odd
        else table[name][rng.integers(len(table[name]))]
        for name in chosen
    }


def _ready(_: Path) -> None:
    import agents
    import baselines

    assert agents
    assert baselines
    for mode, valves, sensors, hand in (
        ("valve", "two_valves", "ideal", "guided"),
        ("flow", "one_valve", "lab", "noise"),
        ("flow", "two_valves", "lab", "sine"),
        ("valve", "one_valve", "ideal", "steps"),
    ):
        env: Any = gymnasium.make_vec(CIRCLE, num_envs=2, action_mode=mode, valves=valves, sensors=sensors, user_force=hand)
        env.reset(seed=0, options={"staggered": True})
        env.step(np.zeros(env.action_space.shape))


def _environment(_prepared: None, rng: Rng, folder: Path, case: Case) -> None:
    vector = bool(rng.integers(2))
    arguments = _drawn(rng, {**GOOD, **(VECTOR if vector else {})}, 0.2)
    given = _drawn(rng, RESET if vector else {name: RESET[name] for name in ("seed", "position")}, 0.3)
    case.names = (*arguments, *given, "reference", "Mechanics", "action", "parameter")
    case.shown = f"{_said(arguments)} {_said(given)}"
    # Gymnasium's own faces check render modes and wrap; the classes are asked directly.
    from birthsim_env.env import BirthSIMEnv
    from birthsim_env.vector_env import BirthSIMVectorEnv

    env: Any = BirthSIMVectorEnv("circle", **arguments) if vector else BirthSIMEnv("circle", **arguments)
    seed = given.pop("seed", None)
    try:
        observation, info = env.reset(seed=seed, options=given or None)
    except gymnasium.error.Error:
        return  # Gymnasium's own refusal of a seed
    for _ in range(STEPS):
        assert env.observation_space.contains(observation)
        if getattr(env, "_ended", np.zeros(1)).any() and arguments.get("autoreset_mode") == "Disabled":
            break
        observation, reward, *_, info = env.step(rng.uniform(-1, 1, env.action_space.shape))
        assert np.isfinite(reward).all()
        assert np.isfinite(env.simulation.plant.state).all()
    assert np.isfinite(info["position"]).all()


def _action(_: None, rng: Rng, folder: Path, case: Case) -> None:
    env: Any = gymnasium.make(CIRCLE) if rng.random() < 0.5 else gymnasium.make_vec(CIRCLE, num_envs=2)
    env.reset(seed=0)
    shape = env.action_space.shape
    value = strange(rng)
    if rng.random() < 0.5:
        value = rng.uniform(-1, 1, shape).astype(object)
        value.flat[rng.integers(value.size)] = strange(rng)
        value = value.tolist()
    case.names, case.shown = ("action",), _said(value)
    env.step(value)


def _makers() -> dict[str, tuple[Callable[..., Any], bool]]:
    """Name -> what is called, and whether the rig is its first argument."""
    from agents.residual.env import ResidualEnv
    from agents.residual.settings import ResidualSettings
    from agents.training.configuration import TrainingSettings
    from birthsim_env.parts import references, stiffness_schedules
    from birthsim_env.parts.hands import contractions, guided, noise, sine, steps, user_forces
    from birthsim_env.physics.plant import Plant
    from birthsim_env.registry import entries

    parts = (
        *(references.Circle, references.Path, references.FixedTarget, stiffness_schedules.StiffnessSchedule),
        *(
            user_forces.ForceProfile,
            steps.AlternatingSteps,
            user_forces.Ramp,
            user_forces.Pulls,
            contractions.Contractions,
        ),
        *(sine.Sine, noise.Noise, guided.Guided),
    )
    laws = [one.made for one in entries("controller") if inspect.isclass(one.made)]
    return {
        **{part.__name__: (part, False) for part in parts},
        **{law.__name__: (law, True) for law in laws},
        "TrainingSettings": (TrainingSettings, False), "ResidualSettings": (ResidualSettings, False), "Plant": (Plant, False),
        "ResidualEnv": (ResidualEnv, False),
    }  # fmt: skip


def _constructors(folder: Path) -> dict[str, tuple[Callable[..., Any], bool]]:
    _ready(folder)
    makers = _makers()
    from birthsim_env.physics.rig.parameters import Parameters

    for name, (_, takes_rig) in makers.items():
        if takes_rig:
            _use(makers[name][0](Parameters()), np.random.default_rng(0))
    makers["ResidualEnv"][0]("probe").reset(seed=0)
    return makers


def _use(made: Any, rng: Rng) -> None:
    """A few steps with what was made: nothing that was accepted fails later."""
    from birthsim_env.parts.hands.user_forces import UserForce
    from birthsim_env.parts.references import Trajectory
    from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
    from birthsim_env.vector_env import BirthSIMVectorEnv

    role = {Trajectory: "reference", UserForce: "user_force", StiffnessSchedule: "stiffness"}
    arguments: dict[str, Any] = {role[kind]: made for kind in role if isinstance(made, kind)}
    env: Any = BirthSIMVectorEnv("circle", num_envs=2, duration=1.0, **arguments) if arguments else None
    if hasattr(made, "command"):
        env = BirthSIMVectorEnv("circle", num_envs=2, policy_period=0.001)
    elif hasattr(made, "action_space"):
        env = made
    if env is None:
        return
    observation, _ = env.reset(seed=int(rng.integers(100)))
    for _ in range(STEPS):
        assert env.observation_space.contains(observation), "an observation outside its space"
        action = (
            made.command(env.measurement, env.reference).T if hasattr(made, "command") else np.zeros(env.action_space.shape)
        )
        assert np.isfinite(action).all(), "a command is not finite"
        observation, reward, *_ = env.step(action)
        assert np.isfinite(reward).all(), "a reward is not finite"
        assert np.isfinite(env.simulation.plant.state).all(), "a state is not finite"


def _constructor(makers: dict[str, tuple[Callable[..., Any], bool]], rng: Rng, folder: Path, case: Case) -> None:
    from birthsim_env.physics.rig.parameters import Parameters

    name = list(makers)[rng.integers(len(makers))]
    make, takes_rig = makers[name]
    tunable = getattr(make, "TUNABLE", None)
    known = list(inspect.signature(make).parameters.values())
    defaults = {one.name: one.default for one in known if one.kind is one.POSITIONAL_OR_KEYWORD}
    if tunable:
        defaults = dict.fromkeys(tunable, 1.0)
    defaults.pop("parameters", None)
    every: dict[str, Any] = {"sizes": (100.0,), "rate": 70.0, "scenario": "probe"}
    required = {one: value for one, value in every.items() if one in defaults}
    if name == "Plant":
        required = {"parameters": Parameters()}
    arguments = {**required}
    for one in [key for key in defaults if rng.random() < 1.5 / len(defaults)]:
        arguments[one] = strange(rng, defaults[one] if isinstance(defaults[one], float) else None)
    case.names = (*arguments, *(f"{one[:6]}" for one in arguments), "range", "knots", "allowed")
    case.shown = f"{name} {_said(arguments)}"
    if rng.random() < 0.05:
        arguments["unknown"] = 1
        case.names += ("unknown",)
    made = make(Parameters(), **arguments) if takes_rig else make(**arguments)
    _use(made, rng)


def _field(_prepared: None, rng: Rng, folder: Path, case: Case) -> None:
    import dataclasses

    from birthsim_env.physics.rig.parameters import Parameters
    from lab.studies.fuzz.files import run_a_little

    rig = Parameters()
    sections = [field.name for field in dataclasses.fields(rig) if field.name != "ranges"]
    changes: dict[Any, Any] = {}
    for _ in range(int(rng.integers(1, 4))):
        section = sections[rng.integers(len(sections))]
        fields = dataclasses.fields(getattr(rig, section))
        field = fields[rng.integers(len(fields))]
        changes[f"{section}.{field.name}"] = strange(rng, field.default if isinstance(field.default, float) else None)
    case.names = tuple(name.partition(".")[2] for name in changes)
    case.names += ("k1", "dead_volume", "mass", "randomize", "policy_period")
    case.shown = _said(changes)
    rig = rig.replace(changes)
    period = rig.electronics.control_period
    run_a_little(rig, rng, policy_period=period * max(1, round(0.01 / period)))


CALLS: dict[str, Kind] = {
    "environment": Kind(_ready, _environment, runs_code=True),
    "action": Kind(_ready, _action),
    "constructor": Kind(_constructors, _constructor, runs_code=True),
    "parameters": Kind(_ready, _field),
}
