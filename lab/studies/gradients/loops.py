"""Closed loops against central differences: every controller, all scenarios, all sensors."""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from baselines.driving import driving
from baselines.named import make_controller
from birthsim_env.gradients.recorder import Recorder
from birthsim_env.loop.rows import STATE
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.gradients.states import SCALES

SIZES = (1e-6, 1e-7, 1e-8)
"""Of the differences, in units of what actions and ``SCALES`` are changed by. Laws cross the overlap of valves in a steep
curve, which larger ones cut off."""

MOTIONS = np.array([0.01, 0.01, 0.1, 0.1])[:, None]
"""m and m/s: size of the end effector's changes."""


SMOOTH = Parameters().replace({f"electronics.{name}": 0.0 for name in ("adc_bits", "dac_bits", "encoder_resolution")})
"""A rig without converters: what these round has a slope of 0 in differences."""


def begun(world: str, lanes: int, controller: str | None = None, steps: int = 20, **arguments: Any) -> Any:
    """Lanes of randomised rigs, ``steps`` policy steps after their episodes began: under a controller, or small actions."""
    rig = arguments.setdefault("parameters", SMOOTH)
    if controller is not None:
        arguments["actuation"] = driving(make_controller(controller, rig), controller)
    env: Any = gymnasium.make_vec(world, num_envs=lanes, randomize=True, **arguments).unwrapped
    env.reset(seed=5)
    rng = np.random.default_rng(0)
    for _ in range(steps):
        env.step(0.1 * rng.standard_normal((lanes, len(env.simulation.action))))
    return env


def compared(env: Any, steps: int = 4, seed: int = 1) -> tuple[NDArray[np.float64], bool]:
    """Errors of the gradient of a random loss over some policy steps to their actions and to the state before them, against
    differences of ``SIZES``, (sizes, L) for lanes whose episodes go on; and whether the taped steps had the bits of the plain.

    An error is relative to the sum of the sizes of what the gradient is a sum of.
    """
    simulation, rng, start = env.simulation, np.random.default_rng(seed), env.get_state()
    lanes, actions = env.num_envs, len(simulation.action)
    chosen, way = (scale * rng.standard_normal((steps, lanes, actions)) for scale in (0.1, 1.0))
    moved, paid = SCALES * rng.standard_normal((18, lanes)), rng.standard_normal((steps, lanes))
    state, motion = (rng.standard_normal((steps, len(unit), lanes)) / unit for unit in (SCALES, MOTIONS))

    def run(size: float, recorder: Recorder | None = None) -> tuple[Array, list[Array], list[Any]]:
        env.set_state(start)
        simulation.recorder = recorder
        simulation.plant.state[:] += size * moved
        total, seen, backs = np.zeros(lanes), list[Any](), list[Any]()
        for k in range(steps):
            _, reward, terminated, truncated, _ = env.step(chosen[k] + size * way[k])
            now = simulation.plant.state.copy()
            total += paid[k] * reward + (state[k] * now).sum(axis=0) + (motion[k] * simulation.motion).sum(axis=0)
            seen += [terminated | truncated, reward, now]
            backs += [recorder.taken()] if recorder else []
        return total, seen, backs

    recorder = Recorder(simulation)
    (_, plain, _), (_, taped, backs) = run(0.0), run(0.0, recorder)
    equal = all(np.array_equal(one, other) for one, other in zip(plain, taped, strict=True))
    carried: Any = None
    parts = []
    for k in reversed(range(steps)):
        carried, by_action = backs[k](carried=carried, reward=paid[k], state=state[k], motion=motion[k])
        parts.append(by_action * way[k].T)
    rows = np.searchsorted(recorder.carried, STATE + np.arange(18))
    parts.append(carried[rows] * moved)
    got, size_of = (f(np.concatenate(parts)).sum(axis=0) for f in (np.asarray, np.abs))
    differences = [(run(size)[0] - run(-size)[0]) / (2 * size) for size in SIZES]
    simulation.recorder = None
    goes_on = ~np.any(plain[::3], axis=0)
    return np.abs(np.stack(differences) - got)[:, goes_on] / size_of[goes_on], equal
