"""Programs of lanes: the code of a thread, run here, computes the bits of ``Loop``; as PTX it has nothing that could differ."""

import itertools
import json
import re

import numpy as np
import pytest
from llvmlite.binding import llvm_version_info

from baselines.named import compiled_names
from birthsim_build.code import ptx, threads
from birthsim_build.code.blocks import SHARED, WIDTH
from birthsim_build.code.compiler import LEAST_LLVM, compile_object
from birthsim_build.device.export import write_programs
from birthsim_build.device.lanes import Lanes
from birthsim_build.device.loops import controlled, pieces_of
from birthsim_build.device.machine import Host
from birthsim_build.device.program import key_of
from birthsim_build.layout import LAYOUT
from birthsim_env import Parameters, registry
from birthsim_env.assembly import assemble
from birthsim_env.episodes import Episodes
from birthsim_env.gradients.right_hand_side import RIG
from birthsim_env.physics.compiled.lanes import PARAMETERS
from tests.build.loops import LOOKS
from tests.build.ptx_loops import functions_in, loops_in, memory_of
from tests.build.targets import assert_fusing_changes_nothing, fill, need_threads

SEED = 2_000_000
WAY, PLANTS = "birthsim_env.parts.references:_path", "birthsim_env.loop.world"


def begun(lanes, scenario="circle", controller=None, **arguments):
    if controller is not None:
        return controlled(scenario, arguments["sensors"], Parameters(), controller, SEED, lanes)
    episodes = Episodes(assemble(lanes, scenario, randomize=True, **arguments))
    episodes.begin_first(list(range(SEED, SEED + lanes)), np.zeros(lanes, dtype=np.int64))
    return episodes


def both(lanes, **loop):
    """A simulation, and a program with the data of its lanes."""
    need_threads()
    episodes, other = begun(lanes, **loop), begun(3 if lanes == 2 else 2, **loop)
    pieces = pieces_of(episodes.simulation)
    made = Lanes(Host(), pieces, pieces_of(other.simulation), lanes)
    fill(made.views, pieces.arrays())
    return episodes.simulation, pieces, made


def differing(pieces, made):
    pairs = enumerate(zip(made.views, pieces.arrays(), strict=True))
    return [k for k, (view, array) in pairs if view is not None and view.tobytes() != array.tobytes()]


EXACT = re.compile(
    r"(add|sub|mul|div|rcp|sqrt)\.rn\.f(32|64)|(neg|abs|min|max|selp|mov)\.f(32|64)|setp\.[a-z]+\.f(32|64)"
    r"|cvt\.(rn|rmi|rpi|rzi)\.(f64|f32|[su]\d+)\.(f64|f32|[su]\d+)|cvt\.f64\.f32|copysign\.f64"
)


def assert_exact(text):
    """No operation but those whose result IEEE 754 defines, and nothing that is elsewhere."""
    operations = set(re.findall(r"\b([a-z]+(?:\.\w+)*\.f(?:32|64)(?:\.\w+)*)\b", text))
    assert any(one.startswith("mul.rn") for one in operations)
    assert {one for one in operations if not EXACT.fullmatch(one)} == set()
    assert re.search(r"\bfma|\.approx|\.full\b|\.ftz\b|\.extern|\bmad\.[a-z.]*f", text) is None


@pytest.fixture(scope="module", params=["_plant", pytest.param("_worn_plant", marks=pytest.mark.slow)])
def code(request, tmp_path_factory):
    """Where the PTX of a target and of a plant is."""
    if llvm_version_info[0] < LEAST_LLVM:
        pytest.skip("needs LLVM 22")
    folder = tmp_path_factory.mktemp("ptx")
    compile_object([WAY, f"{PLANTS}:{request.param}"], "ptx", folder / "code.o", threads=threads.Threads(512))
    return folder / "code.ptx"


def test_ptx_is_exact(code):
    assert_exact(code.read_text())


WRONG = (
    "fma.rn.f64 %fd1, %fd2, %fd3, %fd4;", "sqrt.approx.f64 %fd1, %fd2;", "div.full.f32 %f1, %f2, %f3;",
    "add.f64 %f1, %f2, %f3;", ".extern .func sin",
)  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_not_exact_is_found(wrong):
    with pytest.raises(AssertionError):
        assert_exact(f"mul.rn.f64 %fd1, %fd2, %fd3;\n{wrong}")


ROOTS = 9
"""Of a right-hand side: one of the linkage, and one of each way through a valve."""

TWO_LOOPS = """
.func (.param .b64 func_retval0) one(
	.param .b64 one_param_0
)
{
	ld.param.b64 	%rd1, [one_param_0];
$L__BB0_1:
	ld.global.b64 	%rd2, [%rd1];
	bra.uni 	$L__BB0_3;
$L__BB0_2:
	st.b64 	[%rd1], %rd2;
	@%p2 bra 	$L__BB0_1;
	bra.uni 	$L__BB0_4;
$L__BB0_3:
	sqrt.rn.f64 	%rd2, %rd2;
	@%p1 bra 	$L__BB0_3;
	@%p3 bra 	$L__BB0_2;
$L__BB0_4:
	st.local.b64 	[%SPL], %rd2;
	ret;
}
"""


def test_loops_are_found_with_the_memory_that_they_access():
    inner, outer = loops_in(functions_in(TWO_LOOPS)["one"])
    assert (memory_of(inner), len(inner)) == ({}, 2)
    assert memory_of(outer) == {"ld.global": 1, "st.generic": 1}


def test_steps_of_integration_access_no_memory_but_what_a_block_shares(code):
    """The state is in registers; a right-hand side reads a parameter at most once, and neighbouring threads other banks."""
    text = code.read_text()
    found = [one for one in loops_in(functions_in(text)["advance_one"]) if sum("sqrt.rn" in line for line in one) >= ROOTS]
    assert found
    for loop in found:
        accessed, roots = memory_of(loop), sum("sqrt.rn" in line for line in loop)
        assert accessed.keys() == {"ld.shared"}
        assert 40 < accessed["ld.shared"] * ROOTS / roots <= PARAMETERS
    assert re.findall(r"\.shared .*\[(\d+)\]", text) == [str(SHARED)]
    assert SHARED < 48 * 1024
    assert re.findall(r"entry birthsim_(\w+)\([^)]*\)\s*\.maxntid (\d+)", text) == [("advance", str(WIDTH))]
    column = r"(?:ld|st)\.shared\.b64 .*\[%rd\d+(?:\+(\d+))?\]"
    rows = {int(row or 0) for row in re.findall(column, text)}
    assert {8 * WIDTH * row for row in RIG} <= rows <= set(range(0, SHARED, 8 * WIDTH))


def test_registers_hold_nearly_all_of_a_state(code, tmp_path):
    if ptx.assembler() is None:
        pytest.skip("ptxas is missing: pip install nvidia-cuda-nvcc-cu12")
    taken = ptx.assemble(code, tmp_path / "code.cubin", "sm_90")
    assert taken["shared"] == SHARED
    assert 0 < taken["spilled"] < 512


CASES = {
    "openings": {"sensors": "ideal"},
    "flows of one valve": {"sensors": "honest", "scenario": "forceps", "action_mode": "flow", "valves": "one_valve"},
    "a law": {"sensors": "lab", "controller": "admittance-backstepping"},
    "a policy": {"sensors": "lab", "controller": "residual:circle"},
}


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [1, 33, 1000])
@pytest.mark.parametrize("loop", CASES.values(), ids=CASES)
def test_a_thread_computes_the_bits_of_a_lane(loop, lanes):
    simulation, pieces, made = both(lanes, **loop)
    rng, places = np.random.default_rng(1), {key_of(array): k for k, array in enumerate(pieces.arrays())}
    for _ in range(20 if lanes < 100 else 4):
        actions = rng.uniform(-0.5, 0.5, simulation.action.shape)
        if actions.size:
            made.views[places[key_of(simulation.action)]][...] = actions
        made.views[places[key_of(simulation.impacts)]][...] = 0.0
        simulation.step(actions)
        assert made.advance(simulation.periods) == 0
        assert differing(pieces, made) == []


@pytest.mark.slow
@pytest.mark.weekly
def test_a_hundred_thousand_threads():
    simulation, pieces, made = both(100_000, **CASES["openings"])
    simulation.step(simulation.action)
    assert made.advance(simulation.periods) == 0
    assert differing(pieces, made) == []
    assert len(np.unique(simulation.plant.state[0])) > 99_000


def of_everything():
    """All scenarios, sensors, compiled controllers, and a policy."""
    pairs = itertools.product(registry.names("scenario"), registry.names("sensors"))
    laws = (*compiled_names(listed=True), "residual:circle")
    made = [begun(2, scenario, sensors=sensors) for scenario, sensors in pairs]
    return made + [begun(2, sensors=sensors, controller=name) for name in laws for sensors in ("ideal", "lab")]


def of_cases():
    """Those above of which most is compiled."""
    return [begun(2, **CASES[name]) for name in ("flows of one valve", "a policy")]


@pytest.mark.slow
@pytest.mark.parametrize("loops", [of_cases, pytest.param(of_everything, marks=pytest.mark.weekly)])
def test_ptx_of_stages_is_exact_and_alone(loops, tmp_path):
    """And of what measures an evaluation."""
    made = loops()
    functions = {function for episodes in made for function in pieces_of(episodes.simulation).functions}
    compile_object(sorted(functions | LOOKS), "ptx", tmp_path / "all.o", threads=threads.Threads(1024))
    text = (tmp_path / "all.ptx").read_text()
    assert_exact(text)
    assert len(re.findall(r"^\.visible \.entry", text, re.MULTILINE)) == len(threads.RUNS)
    assert ".visible .func" not in text
    # 1,024 rows of a thread, to begin and to advance, and what stages keep beside them: predictive control needs most.
    frames = list(map(int, re.findall(r"\.local \.align \d+ \.b8\s+__local_depot\d+\[(\d+)\]", text)))
    assert 16 * 1024 < sum(frames) < 32 * 1024


@pytest.mark.slow
@pytest.mark.weekly
def test_fusing_is_given_no_chance(tmp_path):
    loop = pieces_of(begun(2, sensors="lab", controller="admittance-backstepping").simulation)
    compile_object(loop.functions, "ptx", tmp_path / "code.o", threads=threads.Threads(448))
    taken = assert_fusing_changes_nothing(tmp_path, "advance", 100_000)
    # 448 rows, what stages keep beside them, and registers that did not fit.
    assert taken["memory"] < 6 * 1024
    assert taken["spilled"] < 2 * 1024


@pytest.mark.slow
@pytest.mark.parametrize("position", [None, (0.51, 0.01)])
def test_an_exported_program_runs_by_its_own_kernels(position, tmp_path):
    functions, space, data = write_programs([("circle", "lab", "admittance-backstepping")], Parameters(), tmp_path)
    (name,) = data
    words, about = np.fromfile(tmp_path / f"{name}.bin", dtype=np.int64), json.loads((tmp_path / f"{name}.json").read_text())
    lanes, run = 33, Host().load(tuple(functions), threads.Threads(space))
    rows, starts = np.full((about["words_of_data"], lanes), -1.0), np.zeros((6, lanes), dtype=np.int64)
    starts[:3] = np.arange(lanes), SEED + np.arange(lanes) // 3, np.arange(lanes) % 3
    if position:
        starts[3:].view(np.float64)[...] = np.array([[1.0, *position]]).T
    begins = "begin", starts.ctypes.data, lanes
    for kernel, *numbers in (("place", rows.ctypes.data, lanes), begins, *[("advance", about["periods"], 0)] * 3):
        run(kernel, lanes, words.ctypes.data, *numbers)
    assert words[threads.MISSED] == 0
    simulation = (episodes := begun(lanes, sensors="lab", controller="admittance-backstepping")).simulation
    episodes.begin_first(starts[1].tolist(), starts[2], position and np.array(position))
    for _ in range(3):
        simulation.run(simulation.periods)
    found = np.concatenate(simulation.rows())
    expected = {row.name: found[row.number] for row in LAYOUT if row.number < len(found) and row.name in about["rows"]}
    for array, names in episodes.outcome_rows():
        expected |= dict(zip(names, array, strict=True))
    assert expected.keys() == about["rows"].keys()
    for name, row in about["rows"].items():
        np.testing.assert_array_equal(rows[row], expected[name], err_msg=name)
    assert len(np.unique(expected["measured_x"])) == lanes
    assert set(expected["time"]) == {0.03}
