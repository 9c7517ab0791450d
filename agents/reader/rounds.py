"""What a reader is taught with: what it sees while a law runs on rigs that are known, and what they are.

What a law believes changes what is seen. So some lanes believe what the filter of rigs finds, others something near the truth,
as if a good reader told them, and the rest the rig as described.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from agents.reader.settings import ReaderSettings
from baselines.admittance.controller import AdmittanceController
from baselines.driving import driving
from baselines.estimation import rig_reader
from baselines.estimation.rig_filter import EVERY, REACH, SETTLING, TOLD, RigFilter, spread_of
from baselines.estimation.rig_reader import INPUTS, READ
from baselines.network import PolicyNetwork
from baselines.staged import ControllerStage
from birthsim_env.parts.drawn.frictions import with_friction
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, Array
from birthsim_env.physics.rig.parameters import Parameters, value_of

HEEDED, NEAR = 0.45, 0.9
"""Fraction of the lanes that believe what the filter finds, and of these and those that are told something near the truth."""

OFF = (0.03, 0.1, 0.3)
"""Standard deviations, one for each lane, by which the logarithms of what is told differ from the truth; assumed."""

ROWS = {
    "mechanics.mass": "mass", "air.supply_pressure": "supply", "cylinder1.coulomb_friction": "fc1",
    "cylinder2.coulomb_friction": "fc2", "cylinder1.viscous_friction": "fv1", "cylinder2.viscous_friction": "fv2",
    "cylinder1.piston_diameter": "area_p1", "cylinder2.piston_diameter": "area_p2", "valves.time_constant": "tau",
    "chambers.dead_volume": "dead_volume",
}  # fmt: skip
"""Parameter -> the row from which it is read; of a diameter it is an area."""


class Round(NamedTuple):
    """Episodes in N lanes: ``seen`` (T, N, INPUTS) at every reading, the ``truth`` (N, READ) as logarithms over what is
    described, in units of the spread of rigs, and whether the episode went on (T, N)."""

    seen: NDArray[np.float32]
    truth: NDArray[np.float32]
    alive: NDArray[np.bool_]


def truth_of(columns: Array, rig: Parameters) -> Array:
    """Logarithms (READ, N) of the rigs ``columns`` (PARAMETERS, N) over ``rig``."""
    found = []
    for name in TOLD:
        row = columns[PARAMETER_NAMES.index(ROWS[name])]
        found.append(np.log((np.sqrt(4.0 * row / np.pi) if name.endswith("piston_diameter") else row) / value_of(rig, name)))
    return np.stack(found)


def blank() -> PolicyNetwork:
    """A reader that says what the filter finds."""
    pairs = [
        (np.zeros(shape, dtype=np.float32), np.zeros(shape[0], dtype=np.float32)) for shape in ((1, INPUTS), (2 * READ, 2))
    ]
    gates = [(np.zeros((3, 1), dtype=np.float32), np.zeros(3, dtype=np.float32)) for _ in range(2)]
    return PolicyNetwork(np.zeros(INPUTS), np.ones(INPUTS), tuple(pairs), memory=tuple(gates))


class Watched(AdmittanceController):
    """The law with a reader, whose inputs are at hand."""

    inputs: NDArray[np.float32]

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        *before, law = super().controller_stages(sampled)
        return [*before, replace(law, tables=self._all)]

    def _all(self, lanes: int) -> tuple[Any, ...]:
        self.inputs, *others = rig_reader.tables(blank(), lanes)
        return self.inputs, *others

    def finder(self) -> RigFilter:
        """What the filter of rigs remembers."""
        return RigFilter(self._memories[-1][self.rows_of_law() :][: RigFilter.size])


def collect(settings: ReaderSettings, rig: Parameters, number: int, seed: int) -> Round:
    """The ``number``-th round, in worlds from ``seed`` on."""
    rng = np.random.default_rng(seed)
    scenario, friction = (names[number % len(names)] for names in (settings.scenarios, settings.frictions))
    law = Watched(rig, reader=blank())
    env: Any = gymnasium.make_vec(
        environment_id(scenario),
        num_envs=settings.lanes,
        parameters=with_friction(rig, friction),
        randomize=TOLD,
        sensors=settings.sensors,
        policy_period=EVERY,
        autoreset_mode=AutoresetMode.SAME_STEP,
        actuation=driving(law, None),
    ).unwrapped
    nothing = np.zeros(env.action_space.shape, dtype=np.float32)
    try:
        env.reset(seed=seed)
        truth, spread = truth_of(env.simulation.plant.lane_parameters, rig), spread_of(rig)[:READ, None]
        env.step(nothing)
        _tell(law.finder(), truth, spread, rng)
        seen, alive, on = [], [], np.ones(settings.lanes, dtype=np.bool_)
        for _ in range(env.steps - 2):
            _, _, terminated, _, _ = env.step(nothing)
            on = on & ~terminated
            if law.finder().age.max() > SETTLING + EVERY:
                seen.append(np.nan_to_num(law.inputs, posinf=0.0, neginf=0.0))
                alive.append(on)
    finally:
        env.close()
    return Round(np.stack(seen), (truth / spread).T.astype(np.float32), np.stack(alive))


def _tell(finder: RigFilter, truth: Array, spread: Array, rng: np.random.Generator) -> None:
    lot = rng.random(truth.shape[1])
    near = truth + rng.choice(OFF, (1, truth.shape[1])) * rng.normal(size=truth.shape)
    told = np.where(lot < NEAR, np.clip(near, -REACH * spread, REACH * spread), 0.0)
    others = lot >= HEEDED
    finder.heeded[others], finder.told[:READ, others] = 0.0, told[:, others]
