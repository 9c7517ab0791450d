"""``BIRTHSIM_DEBUG=1``: the same stages as plain Python, which a debugger enters, with the same bits."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from birthsim_env.loop import world
from birthsim_env.physics.compiled import plain
from birthsim_env.physics.compiled.compilation import kernel
from tests.env import debugged

ROOT = Path(__file__).parents[2]


def run(*arguments, given=None):
    environment = {**os.environ, "BIRTHSIM_DEBUG": "1", "PYTHONPATH": str(ROOT)}
    return subprocess.run([sys.executable, *arguments], env=environment, cwd=ROOT, input=given, capture_output=True, text=True)


@pytest.fixture(scope="module")
def found():
    done = run("-m", "tests.env.debugged")
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("case", debugged.CASES)
def test_plain_python_has_the_bits_of_machine_code(case, found):
    assert found[case] == debugged.CASES[case]()


def test_python_enters_the_frame_of_a_stage(found):
    ((file, line, lanes),) = found["met"]
    assert (Path(file), lanes) == (Path(world.__file__), 1)
    assert "_plant(" in "".join(Path(file).read_text(encoding="utf-8").splitlines()[line - 1 : line + 1])
    assert debugged.traced("_plant") == [], "machine code has no frames"


SCRIPT = """
import gymnasium, numpy as np, birthsim_env
env = gymnasium.make("BirthSIM/Circle-v2", policy_period=0.001).unwrapped
env.reset(seed=0)
env.step(np.zeros(4, np.float32))
print(env.pipeline)
"""


def test_pdb_stops_in_a_stage_and_the_pipeline_says_that_it_is_plain(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    # The module is imported first, so that the debugger knows where the function is.
    commands = ["import birthsim_env.loop.world", f"break {world.__file__}:{line_of('_move(world, seen, seen.opening')}"]
    commands += ["continue", "p 'stopped', n, float(seen.time[0]), world.rows.shape", "clear 1", "continue", "quit", ""]
    done = run("-m", "pdb", str(script), given="\n".join(commands))
    assert "('stopped', 1, 0.0, (" in done.stdout, done.stdout[-2000:] + done.stderr[-500:]
    assert "birthsim_env.loop.world:_plant (plain Python)" in done.stdout


def line_of(text):
    lines = Path(world.__file__).read_text(encoding="utf-8").splitlines()
    return next(number for number, line in enumerate(lines, 1) if text in line)


def test_nothing_is_built_for_other_targets():
    program = "from birthsim_env.loop import stage, world; stage.compiled(world._plant)"
    done = run("-c", program)
    assert done.returncode != 0
    assert "BIRTHSIM_DEBUG = 1" in done.stderr.splitlines()[-1]
    assert "allowed: " in done.stderr.splitlines()[-1]


@kernel
def powers(x, found):
    found[0], found[1], found[2], found[3] = x[0] ** 3, x[0] ** 7, x[0] ** -2, (x[0] + x[1]) ** 2


def test_a_power_is_rounded_as_by_numba():
    for x in np.random.default_rng(0).uniform(0.1, 9.0, (200, 2)):
        compiled, made = np.zeros(4), np.zeros(4)
        powers(x, compiled)
        made[:3] = plain.power(x[0], 3), plain.power(x[0], 7), plain.power(x[0], -2)
        made[3] = plain.power(x[0] + x[1], 2)
        np.testing.assert_array_equal(made, compiled)
    again = plain.plain(powers.py_func)
    again(x, made)
    np.testing.assert_array_equal(made, compiled)
    assert again.__code__.co_firstlineno == powers.py_func.__code__.co_firstlineno + 1, "below its decorator"


def test_numbers_out_of_a_functions_domain_are_no_errors():
    with np.errstate(all="ignore"):  # as in a process with that setting
        assert np.isnan(plain._MATH.sqrt(-1.0))
        assert 1.0 / plain._MATH.sqrt(0.0) == np.inf
    assert plain._MATH.floor(np.nan) == plain._MATH.floor(np.inf) == plain.NO_NUMBER
    assert plain._MATH.floor(-1.5) == -2
    assert plain._MATH.pi == np.pi


def test_a_word_that_says_neither_is_refused():
    environment = {**os.environ, "BIRTHSIM_DEBUG": "no", "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", "import birthsim_env"], env=environment, capture_output=True, text=True)
    assert done.returncode == 1
    assert "BIRTHSIM_DEBUG = 'no'; allowed: 1" in done.stderr.splitlines()[-1]
