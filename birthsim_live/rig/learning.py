"""What the page needs to learn a controller: the circle with its way back as WebAssembly, and beginnings of episodes as data.

``learn.wasm`` is code of ``birthsim_build.code.adjoints``. ``learn.bin`` has the words of the program; then, in 64 bits, the
data of a lane that begins, and of each row in which beginnings differ one number per beginning; then their observations
(beginnings, D) in 32 bits. ``learn.json`` says what stands where, and how is learned. ``page/learning`` reads them.
"""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from agents.residual.settings import NO_LAW, ResidualSettings
from agents.training.by_gradients.lanes import STIFFNESS, observations
from agents.training.by_gradients.policy_gradient import LEAST, LEAST_RATE, MET, MOMENTS, OBSERVED
from agents.training.margin import widened
from agents.training.validation import TRAINING_SEED
from baselines.network import CLIP, EPSILON
from birthsim_build.building import write_wasm
from birthsim_build.device.loops import pieces_of
from birthsim_build.device.program import key_of, program_of
from birthsim_env.observation import SCALES, SIZE, Observation
from birthsim_env.outcome import Ends
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.reward import LARGEST_COST, Terms
from birthsim_live.rig.folder import compact

BEGINNINGS = 192
"""Rigs, circles and hands of which a lane that begins gets one; assumed."""

MARGIN = 0.3
"""Of ``agents/configurations/circle_apg.toml``: rigs that oscillate more easily than those that a policy is for."""

LEARNER = {"lanes": 32, "horizon": 10, "rate": 5e-3, "updates": 600, "hidden": [64, 64]}
"""Lanes and policy steps of an update, learning rate at first, updates until it is least, and widths of the network."""

BARS = ("action", "observation", "reward", "carried")


def worlds(lanes: int) -> Any:
    """The first ``lanes`` of all beginnings, as an environment."""
    rig = widened(Parameters(), MARGIN)
    env: Any = gymnasium.make_vec(
        "BirthSIM/Circle-v2", num_envs=lanes, parameters=rig, randomize=True, autoreset_mode="SameStep"
    )
    env.reset(seed=TRAINING_SEED)
    return env.unwrapped


def write_learning(folder: Path) -> None:
    """Write ``learn.wasm``, ``learn.bin`` and ``learn.json`` into ``folder``."""
    env, other = worlds(BEGINNINGS), worlds(2)
    simulation, recorder = env.simulation, env.record()
    recorder.prepare()
    many = pieces_of(simulation)
    program = program_of(many, pieces_of(other.simulation), many.functions, recorder.loop)
    regions = {key_of(array): region for array, region in zip(many.arrays(), program.regions, strict=True) if region}
    data = np.zeros((program.rows, BEGINNINGS))
    for array in many.arrays():
        if key_of(array) in regions:
            regions[key_of(array)].of(data, BEGINNINGS)[...] = array
    terms, ends, _, seen = many.closing[0].tables
    first = {
        name: regions[key_of(array)].first
        for name, array in {
            "action": simulation.action,
            "impacts": simulation.impacts,
            "terms": terms,
            "ends": ends,
            "seen": seen,
        }.items()
    }
    data[regions[key_of(seen)].first :][: regions[key_of(seen)].rows] = 0.0
    differs = np.flatnonzero((data != data[:, :1]).any(axis=1))
    write_wasm(many.functions, folder / "learn.wasm", program.threads)
    with (folder / "learn.bin").open("wb") as file:
        for array in (program.words, data[:, 0], data[differs], seen):
            array.tofile(file)
    mean, deviation = _statistics(seen.shape[1])
    content = {
        **LEARNER, "beginnings": BEGINNINGS, "steps": env.steps, "periods": simulation.periods, "period": simulation.period,
        "program": len(program.words), "rows": program.rows, "tape": program.tape(simulation.periods),
        "live": [PARAMETERS, len(recorder.loop.live)], "differs": differs.tolist(),
        "bars": {name: (PARAMETERS + recorder.at[name]).tolist() for name in BARS},
        "at": {
            "action": first["action"], "impacts": first["impacts"], "seen": first["seen"],
            "terminated": first["ends"] + Ends.terminated.first, "reward": first["terms"] + Terms.total.first,
        },
        "error": [Observation.error.first, SCALES[0]],
        "stiffness": [Observation.pneumatic_stiffness.first, Observation.pneumatic_setpoint.first, STIFFNESS],
        "mean": mean.tolist(), "deviation": deviation.tolist(), "clip": CLIP, "largest_cost": LARGEST_COST,
        "moments": MOMENTS, "least_rate": LEAST_RATE, "met": MET,
    }  # fmt: skip
    (folder / "learn.json").write_text(compact(content) + "\n", encoding="utf-8")


def _statistics(size: int) -> tuple[Array, Array]:
    """Mean and standard deviation (``size``,) of observations, as of ``agents.training.by_gradients.policy_gradient``."""
    alone = ResidualSettings(law=NO_LAW).to_dict()
    env: Any = gymnasium.make_vec("BirthSIM/CircleResidual-v2", num_envs=1, randomize=True, **alone)
    _, found = observations(env, TRAINING_SEED, OBSERVED)
    mean, variance = np.zeros(size), np.zeros(size)
    mean[:SIZE], variance[:SIZE] = found[:, :SIZE].mean(axis=0), found[:, :SIZE].var(axis=0)
    return mean, np.sqrt(np.maximum(variance, LEAST**2) + EPSILON)
