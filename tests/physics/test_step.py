"""The step of integration and its switch: order and stability of both methods, and that everything follows the switch."""

import json
import math
import os
import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest

from birthsim_env.physics import classical, ralston
from birthsim_env.physics.step import STEPS
from tests.console import ROOT
from tests.physics.rigs import LAWS

METHODS = {"rk4": classical, "rk3": ralston}
STABLE = {"rk4": 2.785293563405282, "rk3": 2.512745326618329}
"""Where on the negative real axis the polynomials of fourth and third order reach 1 in size."""


def stepped(method: ModuleType, rate: float, x: float, step: float) -> float:
    """One step of dx/dt = ``rate`` x (1 - x), or of dx/dt = ``rate`` x where ``x`` is 1."""
    total = trial = x
    for stage in range(method.STAGES):
        slope = rate * trial * (1 - trial if x != 1.0 else 1.0)
        total, trial = total + method.weight_of(stage, step) * slope, x + method.ahead_of(stage, step) * slope
    return total


@pytest.mark.parametrize("name", METHODS)
def test_a_method_converges_with_its_order(name: str) -> None:
    """Growth with a bound, x = 1/(1 + 9 exp(-2 t)) over 1 s."""
    method, exact, errors = METHODS[name], 1 / (1 + 9 * math.exp(-2.0)), []
    for steps in (10, 20, 40, 80):
        x = 0.1
        for _ in range(steps):
            x = stepped(method, 2.0, x, 1 / steps)
        errors.append(abs(x - exact))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, method.STAGES, atol=0.15)
    assert errors[-1] < 1e-7


@pytest.mark.parametrize("name", METHODS)
def test_a_method_is_stable_up_to_where_its_polynomial_is(name: str) -> None:
    assert abs(stepped(METHODS[name], -0.999 * STABLE[name], 1.0, 1.0)) < 1
    assert abs(stepped(METHODS[name], -1.001 * STABLE[name], 1.0, 1.0)) > 1


@pytest.mark.parametrize("name", METHODS)
def test_what_a_step_allows_is_stable(name: str) -> None:
    """The limits that the model sets leave at least a tenth of what is stable."""
    step = STEPS[name]
    sound = math.sqrt(1.4 * 287.05 * 293.15)
    allowed = [step.relaxation_limit, step.elasto_plastic_limit, step.fastest_rate, sound / step.shortest_tube]
    allowed += [step.fastest_air] if math.isfinite(step.fastest_air) else []
    assert max(allowed) * step.seconds < 0.91 * STABLE[name]


def run(*line: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """A process of Python with other environment variables."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
    return subprocess.run([sys.executable, *line], cwd=ROOT, env=environment, capture_output=True, text=True)


def test_another_word_is_refused() -> None:
    done = run("-c", "import birthsim_env.physics.step", BIRTHSIM_STEP="rk2")
    assert done.returncode == 1
    assert f"BIRTHSIM_STEP = 'rk2'; allowed: {', '.join(STEPS)}" in done.stderr.splitlines()[-1]


FOLLOWS = """
import json
from birthsim_env.physics.compiled.sources import ROOT, source_stamp
from birthsim_env.physics.rig.parameters import Parameters
refused = ""
try:
    Parameters().replace({"valves.sonic_conductance": 2e-8, "chambers.dead_volume": 5e-6})
except ValueError as error:
    refused = str(error)
print(json.dumps([source_stamp(ROOT / "birthsim_env/physics/dynamics.py"), refused]))
"""


def test_machine_code_and_what_rigs_may_be_follow_the_step() -> None:
    """Machine code of another step has another name; air that settles too fast for the longer step is refused."""
    (usual, allowed), (other, refused) = (json.loads(run("-c", FOLLOWS, BIRTHSIM_STEP=word).stdout) for word in ("", "rk3"))
    assert len(usual) == len(other) == 64
    assert usual != other
    assert allowed == ""
    assert refused.startswith("Chambers.dead_volume = 5e-06 is impossible with these valves; allowed: at least")


def test_the_plant_takes_three_steps_of_third_order_and_its_derivatives_are_theirs() -> None:
    """In plain Python: the textbook's state; differences of the discrete map; adjoint and tangent agree."""
    done = run("-m", "tests.physics.stepped", *LAWS, BIRTHSIM_STEP="rk3", BIRTHSIM_DEBUG="1")
    assert done.returncode == 0, done.stderr[-1000:]
    for law, found in json.loads(done.stdout).items():
        assert found["steps"] == [3]
        np.testing.assert_allclose(found["plant"], found["textbook"], rtol=1e-12, atol=1e-14, err_msg=law)
        np.testing.assert_allclose(found["tangent"], found["difference"], rtol=1e-7, atol=1e-8, err_msg=law)
        assert found["adjoint"][0] == pytest.approx(found["adjoint"][1], rel=1e-11), law


@pytest.mark.slow
def test_the_physics_holds_with_the_other_step() -> None:
    """All tests that integrate, and those of derivatives, compiled for steps of third order."""
    integrating = ("balances", "chambers", "dynamics", "equilibrium", "friction", "linear", "mechanics", "second_model")
    rooms = ("tests/physics/plant", *(f"tests/physics/test_{name}.py" for name in integrating))
    rooms += ("tests/gradients/test_plant.py", "tests/gradients/test_loop.py", "tests/bench/test_twin.py")
    line = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not slow", *rooms]
    done = run(*line, BIRTHSIM_STEP="rk3")
    assert done.returncode == 0, done.stdout[-3000:]
