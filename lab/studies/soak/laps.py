"""A lap of the soak: one world, drawn from its number, run for ``STEPS`` policy steps over ``LANES`` lanes."""

import gc
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

import agents
from agents.residual.settings import IMPEDANCES, LAWS, NO_LAW
from baselines.named import make_controller
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.parts.scenarios import environment_id, rig_of
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names

assert agents  # registers the environments with a law inside

LANES, STEPS = 512, 200
RIVALS = ("pid", "lqr", "sliding-mode", "backstepping-cartesian")
FRICTION = ("lugre", "coulomb", "elasto_plastic")
VARIED = (False, "scenario", True)

FIELDS = (
    *("position", "velocity", "pressure", "temperature", "piston_position", "piston_velocity", "user_force"),
    *("tracking_error", "pneumatic_force", "pneumatic_stiffness"),
)


@dataclass
class World:
    """What a lap is."""

    scenario: str
    control: str
    sensors: str
    friction: str
    randomize: bool | str
    hand: str | None
    corner: dict[str, float]
    arguments: dict[str, Any]


@dataclass
class Lap:
    """What a lap has found; ``faults`` are in words, ``rss`` is in MB after it."""

    number: int
    scenario: str
    control: str
    steps: int
    seconds: float
    terminated: int
    truncated: int
    rss: float
    faults: list[str] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it."""
        return asdict(self)


def world_of(number: int, seed: int) -> World:
    """The world of a lap: scenarios take turns, everything else is drawn."""
    rng = np.random.default_rng([seed, number])

    def one(options: Any) -> Any:
        return options[int(rng.integers(len(options)))]

    scenario = names("scenario")[number % len(names("scenario"))]
    friction, sensors, randomize = one(FRICTION), one(names("sensors")), one(VARIED)
    rig = rig_of(scenario, None)
    ranges = documented_ranges(rig)
    corner = {name: float(one(bounds)) for name, bounds in ranges.items()} if randomize is not True else {}
    hand = one([None, None, None, *names("hand")])
    kind = rng.random()
    if kind < 0.6:
        arguments = {"action_mode": one(("valve", "flow")), "valves": one(("two_valves", "one_valve"))}
        control = f"random {arguments['action_mode']}s"
    elif kind < 0.92:
        law = one(LAWS)
        fixed = law == NO_LAW or law.startswith("admittance") or rig.linkage.is_rail
        impedance = "fixed" if fixed else one(list(IMPEDANCES))
        arguments = {"law": law, "impedance": impedance}
        control = "residual without a law" if law == NO_LAW else f"residual on {law}"
    else:
        control, arguments = one(RIVALS), {"policy_period": 0.001}
    return World(scenario, control, sensors, friction, randomize, hand, corner, arguments)


def _policy(world: World, env: Any, rig: Parameters, rng: np.random.Generator) -> Iterator[Array]:
    """Actions (LANES, size): those of a rival; else per lane and 0.3 s nothing, noise, held noise, or full openings."""
    if world.control in RIVALS:
        law = make_controller(world.control, rig)
        while True:
            yield law.command(env.unwrapped.measurement, env.unwrapped.reference).T
    shape = env.action_space.shape
    step = 0
    while True:
        if step % 30 == 0:
            held, kind = rng.uniform(-1, 1, shape), rng.integers(4, size=(shape[0], 1))
        white = rng.uniform(-1, 1, shape)
        yield np.choose(kind, [np.zeros(shape), white, held, np.sign(held)])
        step += 1


def _faults(env: Any, observation: Array, rewards: Array, info: dict[str, Any]) -> Iterator[str]:
    space = env.single_observation_space
    if not np.isfinite(observation).all():
        yield "an observation is not finite"
    elif observation.min() < space.low.min() or observation.max() > space.high.max():
        yield "an observation is outside its space"
    if not (np.isfinite(rewards).all() and rewards.min() >= 0.0 and rewards.max() <= 1.0):
        yield f"rewards from {rewards.min()} to {rewards.max()}"
    if not np.isfinite(env.unwrapped.simulation.plant.state).all():
        yield "a state is not finite"
    for name in FIELDS:
        if not np.isfinite(info[name]).all():
            yield f"info[{name!r}] is not finite"
        elif "final_info" in info and not np.isfinite(info["final_info"][name]).all():
            yield f"final_info[{name!r}] is not finite"


def run(number: int, seed: int, lanes: int = LANES, steps: int = STEPS, progress: Callable[[int], Any] | None = None) -> Lap:
    """Run a lap; a fault ends it."""
    world = world_of(number, seed)
    lap, began = Lap(number, world.scenario, world.control, 0, 0.0, 0, 0, 0.0), time.perf_counter()
    rig = rig_of(world.scenario, None).replace({**world.corner, "friction.law": world.friction})
    residual = "law" in world.arguments
    env: Any = gymnasium.make_vec(
        environment_id(world.scenario, "Residual" if residual else ""),
        num_envs=lanes,
        parameters=rig,
        sensors=world.sensors,
        randomize=world.randomize,
        user_force=world.hand,
        num_threads=1,
        autoreset_mode=AutoresetMode.SAME_STEP,
        **world.arguments,
    )
    env.reset(seed=number * lanes, options={"staggered": True})
    for action in _policy(world, env, rig, np.random.default_rng([seed, number, 1])):
        observation, rewards, terminated, truncated, info = env.step(action)
        lap.steps += lanes
        lap.terminated += int(terminated.sum())
        lap.truncated += int(truncated.sum())
        lap.faults = list(_faults(env, observation, rewards, info))
        if lap.faults or lap.steps >= steps * lanes:
            break
        if progress is not None:
            progress(lanes)
    env.close()
    del env
    gc.collect()
    lap.seconds, lap.rss = time.perf_counter() - began, _resident()
    return lap


def _resident() -> float:
    """Memory of this process, MB."""
    with open("/proc/self/statm", encoding="ascii") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize() / 2**20
