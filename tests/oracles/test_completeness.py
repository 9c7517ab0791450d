"""Every parameter is used: by the plant, and by each oracle that computes the plant's motion a second time.

An oracle is asked whether its rates change with a parameter. One that has been added to the kernels and not to an oracle, whose
value is 0 in all that is compared, would else be checked by nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, parameter_array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of
from lab.studies.accuracy import second_model
from lab.studies.speed import twin

ELSEWHERE = {
    "mechanics.impact_speed": "an episode reports impacts, which the plant only measures",
    "valves.crossing": "whoever inverts the characteristic crosses the overlap over it",
    "air.polytropic_index": "the control model's, with which controllers and starts compute",
    "chambers.pressure_cells": "sensors measure there",
}
"""Parameters of the plant's sections that move nothing, and who uses them."""

NAMES = [name for name in DECLARED if not name.startswith("electronics.")]
EVERYTHING = {name: one.range[1] for name, one in DECLARED.items() if one.on_request and name in NAMES}
"""All options of the plant, with the ends of their ranges: some act only where another one is on."""

SITUATIONS = 6


def another(rig: Parameters, name: str) -> Parameters:
    """``rig`` with another value of a parameter, one that it allows."""
    one, now = DECLARED[name], value_of(rig, name)
    numbers = () if one.choices else (*(one.range or ()), 1.04 * now, 0.97 * now, 1e-3 * one.most)
    for value in (*one.choices, *numbers):
        try:
            changed = rig.replace({name: value})
        except ValueError:
            continue
        if value_of(changed, name) != now:
            return changed
    raise AssertionError(f"{name} = {now!r} has no other value that a rig allows")


@dataclass
class Case:
    """A rig, the same rig with each parameter changed, and situations that all are in."""

    rig: Parameters
    others: dict[str, Parameters]
    states: Array  # (18, SITUATIONS)
    command: Array
    force: Array

    def laid_out(self) -> tuple[Array, Array, Array, Array]:
        """Lanes of the rig and of all others: states, openings, forces, parameters; situations vary fastest."""
        rigs = [self.rig, *self.others.values()]
        repeated = (np.tile(rows, len(rigs)) for rows in (self.states, self.command, self.force))
        return *repeated, np.repeat(parameter_array(rigs, len(rigs)), SITUATIONS, axis=1)

    def changing(self, answers: Array) -> set[str]:
        """Names of the parameters that change ``answers`` (M, lanes)."""
        first, *others = np.split(answers, len(self.others) + 1, axis=1)
        return {name for name, own in zip(self.others, others, strict=True) if not np.array_equal(first, own)}


def case(changes: dict[str, Any], seed: int) -> Case:
    rng = np.random.default_rng(seed)
    rig = Parameters().replace(changes)
    column = parameter_array(rig, SITUATIONS)
    # Inside the strokes and, in the last situations, in an end stop.
    reach = np.where(np.arange(SITUATIONS) < SITUATIONS - 2, 0.6, 1.002)
    piston = rng.choice([-1.0, 1.0], (2, SITUATIONS)) * reach * column[[at.HALF_L1, at.HALF_L2]]
    speed = rng.choice([-1.0, 1.0], (2, SITUATIONS)) * 10 ** rng.uniform(-3.5, -0.5, (2, SITUATIONS))
    states = balanced_state(column, piston, speed)
    states[[at.Z1, at.Z2]] *= rng.uniform(0.75, 1.0, (2, SITUATIONS))
    states[list(at.PRESSURES)] = rng.uniform(1.1e5, 6.9e5, (4, SITUATIONS))
    states[list(at.TEMPERATURES)] += rng.uniform(-9.0, 9.0, (4, SITUATIONS))
    states[list(at.SPOOLS)] = rng.uniform(-0.9, 0.9, (4, SITUATIONS))
    command, force = rng.uniform(-1.0, 1.0, (4, SITUATIONS)), rng.uniform(-40.0, 40.0, (2, SITUATIONS))
    given = rig.linkage.locked_geometry(1.0, 1.0) if rig.linkage.is_rail else {}
    names = [name for name in NAMES if name.removeprefix("geometry.") not in given]
    return Case(rig, {name: another(rig, name) for name in names}, states, command, force)


CASES = [case({"friction.law": law}, seed) for seed, law in enumerate(DECLARED["friction.law"].choices)]
CASES.append(case(EVERYTHING, len(CASES)))
CASES.append(case({"linkage.kind": "rail"}, len(CASES)))


def in_the_kernel(case: Case) -> set[str]:
    state, command, force, parameters = case.laid_out()
    rates = np.empty_like(state)
    dynamics.derivatives(state, command, force, parameters, rates)
    return case.changing(rates)


def in_the_second_model(case: Case) -> set[str]:
    answers = []
    plant = Plant(case.rig, SITUATIONS)
    plant.state[:] = case.states
    seen = plant.end_effector()
    for rig in (case.rig, *case.others.values()):
        for k in range(SITUATIONS):
            start = second_model.SecondModel(case.rig, seen[:, k], case.states[:, k]).state
            answers.append(second_model.rates(start, case.command[:, k], case.force[:, k], *second_model.constants(rig)))
    return case.changing(np.stack(answers, axis=1))


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> twin.Twin:
    if not twin.has_compiler():
        pytest.skip("no gcc")
    return twin.Twin(tmp_path_factory.mktemp("twin"), twin.PLAIN)


def unknown(found: Callable[[Case], set[str]], left_out: dict[str, str], oracle: str, file: str) -> list[str]:
    """What is wrong with an oracle, in words."""
    kernel, own = (set().union(*map(changing, CASES)) for changing in (in_the_kernel, found))
    lacking = [
        f"{oracle} does not know {name}: compute with it as birthsim_env/physics/dynamics.py does, or say why not in LEFT_OUT "
        f"of {file}"
        for name in sorted(kernel - own - left_out.keys())
    ]
    needless = sorted(left_out.keys() - (kernel - own))
    return [*lacking, *(f"{oracle} knows {name}, or need not: take it from LEFT_OUT of {file}" for name in needless)]


def test_the_second_model_knows_every_parameter_of_the_kernel() -> None:
    file = "lab/studies/accuracy/second_model.py"
    assert unknown(in_the_second_model, second_model.LEFT_OUT, file, file) == []


def test_the_twin_in_c_knows_every_parameter_of_the_kernel(built: twin.Twin) -> None:
    def in_the_twin(case: Case) -> set[str]:
        state, command, force, parameters = map(np.ascontiguousarray, case.laid_out())
        built.advance(state, command, force[None], parameters, 1, 1e-5, np.empty_like(force))
        return case.changing(state)

    assert unknown(in_the_twin, twin.LEFT_OUT, "lab/studies/speed/twin.c", "lab/studies/speed/twin.py") == []


def test_every_parameter_moves_the_plant() -> None:
    used: set[str] = set()
    for one in CASES:
        rigs = [rig for rig in (one.rig, *one.others.values()) for _ in range(SITUATIONS)]
        state, command, force, _ = one.laid_out()
        plant = Plant(rigs, len(rigs))
        plant.state = state
        plant.advance(command, force, 0.002)
        used |= one.changing(np.concatenate([plant.state, plant.end_effector()]))
    unused = set(NAMES) - used - ELSEWHERE.keys()
    assert unused == set(), "declared in physics/rig, and no kernel of the plant computes with it"
    assert used & ELSEWHERE.keys() == set()
