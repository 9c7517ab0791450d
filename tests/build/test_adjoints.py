"""The way back through a program: threads, here and in WebAssembly, compute the bits of ``TapedLoop``."""

import subprocess
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import pytest

import agents  # noqa: F401  registers the residual environments
from birthsim_build.building import write_wasm
from birthsim_build.code.compiler import compile_object
from birthsim_build.code.elf import undefined_in
from birthsim_build.code.targets import HOST
from birthsim_build.device import machine
from birthsim_build.device.lanes import Lanes
from birthsim_build.device.loops import pieces_of
from birthsim_build.device.machine import machine_named
from birthsim_build.device.program import Pieces, program_of
from birthsim_env.gradients.recorder import Recorder
from birthsim_env.physics.compiled.lanes import PARAMETERS
from tests.build.targets import assert_fusing_changes_nothing, assert_same_bits, fill, need_linker, need_program, need_threads
from tests.build.test_threads import assert_exact

CASES = {
    "openings": {"id": "BirthSIM/Circle-v2"},
    "honest sensors": {"id": "BirthSIM/Circle-v2", "sensors": "honest"},
    "a hand that feels": {"id": "BirthSIM/Probe-v3", "user_force": "guided"},
    "a law": {"id": "BirthSIM/CircleResidual-v2", "sensors": "lab"},
}


class Made(NamedTuple):
    """A simulation that keeps a tape, and the same loop as a program."""

    simulation: Any
    recorder: Recorder
    pieces: Pieces
    like: Pieces

    def program(self):
        return program_of(self.pieces, self.like, self.pieces.functions, self.recorder.loop)


def made(lanes, **arguments):
    envs = [gymnasium.make_vec(num_envs=n, randomize=True, **arguments).unwrapped for n in (lanes, 3 if lanes == 2 else 2)]
    for env in envs:
        env.reset(seed=5)
    one, other = (env.simulation for env in envs)  # type: ignore[attr-defined]
    recorder = Recorder(one)
    recorder.prepare()
    return Made(one, recorder, pieces_of(one), pieces_of(other))


def flat(tape, lanes):
    """A tape of blocks as (rows, lanes)."""
    return tape.transpose(1, 0, 2).reshape(tape.shape[1], -1)[:, :lanes]


def back_here(made, bars):
    (tape, periods, rig), found = made.recorder._last, bars.copy()
    made.recorder.loop.back(periods, tape, rig, found)
    return found


@pytest.mark.parametrize("lanes", [1, 33, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "case",
    [
        "openings",
        pytest.param("a hand that feels", marks=pytest.mark.slow),
        *(pytest.param(name, marks=pytest.mark.weekly) for name in ("honest sensors", "a law")),
    ],
)
def test_a_thread_goes_back_as_a_lane(case, lanes, device):
    here = made(lanes, **CASES[case])
    simulation, loop, rng = here.simulation, here.recorder.loop, np.random.default_rng(0)
    place = machine_named(device)
    there = Lanes(place, here.pieces, here.like, lanes, loop)
    for _ in range(3):
        actions = rng.uniform(-0.3, 0.3, simulation.action.shape)
        simulation.action[:], simulation.impacts[:] = actions, 0.0
        fill(there.views, map(place.arrays.asarray, here.pieces.arrays()))
        simulation.step(actions)
        tape = there.new_tape(simulation.periods)
        assert there.advance(simulation.periods, tape) == 0
        first = PARAMETERS + len(loop.live)
        assert_same_bits(place.local(tape[:PARAMETERS]), simulation.plant.lane_parameters)
        assert_same_bits(place.local(tape[first:]), flat(here.recorder._last[0], lanes))
        bars = rng.normal(size=(len(loop.live), lanes))
        tape[PARAMETERS:first] = place.arrays.asarray(bars)
        there.back(simulation.periods, tape)
        found = back_here(here, bars)
        assert_same_bits(place.local(tape[PARAMETERS:first]), found)
        assert np.abs(found - bars).max() > 0.1


@pytest.mark.slow
@pytest.mark.weekly
def test_webassembly_goes_back_with_the_same_bits(tmp_path):
    need_linker()
    need_program("node", "nodejs")
    lanes, here = 3, made(3, **CASES["openings"])
    program, simulation, loop = here.program(), here.simulation, here.recorder.loop
    write_wasm(here.pieces.functions, tmp_path / "code.wasm", program.threads)
    actions = np.random.default_rng(1).uniform(-0.3, 0.3, simulation.action.shape)
    simulation.action[:] = actions
    data, tape = np.zeros((program.rows, lanes)), np.zeros((program.tape(simulation.periods), lanes))
    bars = np.random.default_rng(2).normal(size=(len(loop.live), lanes))
    views = [region and region.of(data, lanes) for region in program.regions]
    fill(views, here.pieces.arrays())
    for name, array in (("program", program.words), ("data", data), ("tape", tape), ("bars", bars)):
        array.tofile(tmp_path / name)
    line = ["node", Path(__file__).with_name("way_back.mjs"), tmp_path, lanes, simulation.periods, PARAMETERS]
    subprocess.run([str(word) for word in line], check=True)
    simulation.step(actions)
    data[:], tape[:] = (np.fromfile(tmp_path / name).reshape(-1, lanes) for name in ("data", "tape"))
    for view, array in zip(views, here.pieces.arrays(), strict=True):
        assert view is None or view.tobytes() == array.tobytes()
    assert_same_bits(tape[PARAMETERS + len(loop.live) :], flat(here.recorder._last[0], lanes))
    assert_same_bits(tape[PARAMETERS : PARAMETERS + len(loop.live)], back_here(here, bars))


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", [pytest.param(name, marks=pytest.mark.weekly if name in ("honest sensors", "a law") else ()) for name in CASES]
)
def test_the_way_back_is_exact_and_alone(tmp_path, case):
    need_threads()
    here = made(3, **CASES[case])
    threads, functions = here.program().threads, tuple(here.pieces.functions)
    # That of this processor is what lanes above have run.
    for target in (HOST, "aarch64") if case == "a law" else (HOST,):
        assert set(undefined_in(machine._compiled(functions, target, threads, ".o"))) <= {"memset"}  # which every C has
    compile_object(functions, "ptx", tmp_path / "code.o", threads=threads)
    assert_exact((tmp_path / "code.ptx").read_text())
    if case == "a law":  # which has most
        taken = assert_fusing_changes_nothing(tmp_path, "backward", 50_000)
        assert taken["spilled"] < 16 * 1024  # of all functions
