"""The Lyapunov function: along the paper's state model with the law's virtual flows, and along a run on the plant."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from baselines import BacksteppingController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.lyapunov import PNEUMATIC_UNIT, LyapunovFunction, LyapunovValue
from tests.oracles import closed_loop
from tests.oracles import derived_law as derived
from tests.oracles.closed_loop import FRICTIONLESS, IDEAL
from tests.oracles.strict_feedback import strict_feedback_rates

LANES, STEP = 4, 2e-4
UNITS = ((1.0, 0.0, 1.0, 0.0), (0.0, 1.0, 0.0, 1.0))


def target(time: float, rig: Parameters, stiffness: tuple[float, float]) -> Reference:
    """Both joints swing, with up to 0.14 m/s, and the pneumatic stiffness falls."""
    rates = np.array([3.0, 2.5])
    angles = rates * time + np.array([0.4, 1.0])
    wanted = np.concatenate([np.array([0.045, 0.06]) * rates**k * np.sin(angles + k * np.pi / 2) for k in range(4)])
    rows = np.repeat(derived.cartesian(wanted[:, None], rig).rows, LANES, axis=1)
    rows[8:10] = np.array(stiffness)[:, None]
    rows[10:12], rows[12:14] = closed_loop.PNEUMATIC_STIFFNESS - 200.0 * time, -200.0
    return Reference(rows)


def measured(x: Array, rig: Parameters) -> Measurement:
    """Exact sensors on a state of the model, rows y2 v2 F2 K2 y1 v1 F1 K1 (12)."""
    piston, speed, clock = x[[4, 0]], x[[5, 1]], np.zeros(x.shape[1])
    velocity = np.einsum("ijn,jn->in", geometry.jacobian(piston, rig), speed)
    air, position = derived.air_for(x[[6, 2]], x[[7, 3]], piston, rig), geometry.end_effector(piston, rig)
    return Measurement(clock, position, clock, velocity, air, np.zeros((2, x.shape[1])), sampled=False)


def virtual_flows(law: BacksteppingController, x: Array, reference: Reference) -> Array:
    """U of (12), qA2 qT2 qA1 qT1, at which the model's dF/dt and dK/dt are what the law asks for: it is linear in U."""
    terms, rig = law.inspect(measured(x, law.parameters), reference), law.parameters
    u = np.zeros((4, x.shape[1]))
    still = strict_feedback_rates(x, u, rig)
    active, pressurization = (strict_feedback_rates(x, u + np.array(unit)[:, None], rig) - still for unit in UNITS)
    u[[2, 0]] = (terms.force_rate - still[[6, 2]]) / active[[6, 2]]
    u[[3, 1]] = (terms.pneumatic_stiffness_rate - still[[7, 3]] - active[[7, 3]] * u[[2, 0]]) / pressurization[[7, 3]]
    return u


def run(law: BacksteppingController, stiffness: tuple[float, float], seconds: float) -> list[LyapunovValue]:
    """V along the state model, integrated by SciPy from errors at the start."""
    rig, rng = law.parameters, np.random.default_rng(4)
    function = LyapunovFunction(law)
    start = law.inspect(measured(at_rest(rig), rig), target(0.0, rig, stiffness)).wanted
    x = np.empty((8, LANES))
    x[[4, 0]] = start[0:2] + rng.uniform(-0.002, 0.002, (2, LANES))
    x[[5, 1]] = start[2:4] + rng.uniform(-0.05, 0.05, (2, LANES))
    x[[6, 2]], x[[7, 3]] = 0.0, closed_loop.PNEUMATIC_STIFFNESS + rng.uniform(-200, 200, (2, LANES))
    x[[6, 2]] = law.inspect(measured(x, rig), target(0.0, rig, stiffness)).wanted_force + rng.uniform(-5, 5, (2, LANES))

    def slope(time: float, x: Array) -> Array:
        x = x.reshape(8, LANES)
        flows = virtual_flows(law, x, target(time, rig, stiffness))
        return strict_feedback_rates(x, flows, rig, neglected=law.weight_compensation).ravel()

    times = STEP * np.arange(round(seconds / STEP))
    path = solve_ivp(slope, (0, times[-1]), x.ravel(), "DOP853", times, rtol=1e-11, atol=1e-11)
    states = path.y.T.reshape(-1, 8, LANES)
    return [function.evaluate(measured(x, rig), target(time, rig, stiffness)) for time, x in zip(times, states, strict=True)]


def at_rest(rig: Parameters) -> Array:
    """Some state of the model."""
    x = np.zeros((8, LANES))
    x[[7, 3]] = closed_loop.PNEUMATIC_STIFFNESS
    return x


CASES: dict[str, tuple[dict[str, Any], tuple[float, float], bool]] = {
    "paper": ({}, (2000.0, 2000.0), True),
    "compensated, gains that vary": ({"weight_compensation": True}, (1200.0, 4000.0), True),
    "damped": ({"damping_ratio": 1.1}, (2000.0, 2000.0), True),
    "damped, gains that vary": ({"weight_compensation": True, "damping_ratio": 1.1}, (1200.0, 3000.0), False),
}


@pytest.mark.parametrize(("options", "stiffness", "proved"), CASES.values(), ids=CASES.keys())
def test_it_falls_on_the_model_as_predicted(options: dict[str, Any], stiffness: tuple[float, float], proved: bool) -> None:
    """V falls as predicted and stays below the bound of ``decay``, which proves nothing where unequal gains vary quickly."""
    values = run(BacksteppingController(FRICTIONLESS, **options), stiffness, 0.05)
    v, rate, decay = (np.array([getattr(value, name) for value in values]) for name in ("value", "rate", "decay"))
    assert np.all(np.diff(v, axis=0) < 0)
    assert np.all(v[-1] < 0.4 * v[0])
    slope = (v[:-4] - 8 * v[1:-3] + 8 * v[3:-1] - v[4:]) / (12 * STEP)
    np.testing.assert_allclose(slope, rate[2:-2], rtol=2e-6, atol=1e-8 * np.abs(rate).max())
    for value in values:
        np.testing.assert_allclose(value.value, (value.errors**2).sum(axis=0) / 2, rtol=1e-14)
    if proved:
        assert np.all(decay > 10)
        bound = v[0] * np.exp(-2 * np.cumsum(decay, axis=0) * STEP)
        assert np.all(v[1:] < bound[:-1] * (1 + 1e-4))
    else:
        assert decay.min() < 0


def test_its_errors_are_those_of_the_derivation() -> None:
    """z1, z2 and g z3 of ``derived_law`` at states of the paper's model, and the pneumatic stiffness (9)."""
    rig, options = Parameters(), {"weight_compensation": True, "sign_width": 0.01}
    x = at_rest(rig)
    x[[4, 0]], x[[5, 1]], x[[6, 2]] = [[0.03], [-0.05]], [[0.1], [-0.2]], [[-40.0], [12.0]]
    reference = target(0.1, rig, (1500.0, 2500.0))
    got = LyapunovFunction(BacksteppingController(rig, **options)).evaluate(measured(x, rig), reference)  # type: ignore[arg-type]
    gains = derived.gains_for(x[[4, 0]], reference.stiffness, rig)
    wanted = BacksteppingController(rig).inspect(measured(x, rig), reference).wanted
    levels = derived.coulomb_levels(derived.air_for(x[[6, 2]], x[[7, 3]], x[[4, 0]], rig), x[[5, 1]], rig)
    found = derived.errors_and_rates()[0](
        *x[[4, 0]], *x[[5, 1]], *x[[6, 2]], *wanted, *gains, 0.0, 0.0, *derived.rig_values(rig, 0.01, True, coulomb=levels)
    )
    for i, (z1, z2, z3, g) in enumerate(found):
        np.testing.assert_allclose(got.errors[:3, i], [z1, z2, g * z3], rtol=1e-9)
    e = PNEUMATIC_UNIT * (x[[7, 3]] - reference.pneumatic_stiffness)
    np.testing.assert_allclose(got.errors[3], e, rtol=1e-9)


@pytest.mark.parametrize("valves", ["two_valves", "one_valve"])
@pytest.mark.parametrize(("rig", "left"), [(IDEAL, 1e-4), (FRICTIONLESS, 5e-3)], ids=["linear valves", "catalogue"])
def test_along_a_run_on_the_plant(rig: Parameters, left: float, valves: str) -> None:
    """A step of 3 mm on both axes, without dry friction: V, with all that the model leaves out, falls by four decades.

    Valves with an overlap, which the law crosses softly, leave the force an error: two to three decades.
    """
    law = BacksteppingController(rig, weight_compensation=True, valves=valves)
    position = np.array([[0.5, 0.45], [0.0, 0.05]])
    plant = closed_loop.resting_at(closed_loop.holding(position, 2000.0), rig)
    function, reference, path = LyapunovFunction(law), closed_loop.holding(position + 0.003, 2000.0), []
    for time, wanted, push, _ in closed_loop.run(plant, law.command, lambda t: reference, lambda t: np.zeros((2, 2)), 0.5):
        path.append(function.evaluate(closed_loop.ideal(plant, time, push), wanted))
    v, rate = np.array([value.value for value in path]), np.array([value.rate for value in path])
    assert np.all(v[-1] < left * v[0])
    assert np.all(rate <= 0)
    assert np.all(np.array([value.errors[3] for value in path])[-1] == 0) == (valves == "one_valve")


def test_it_keeps_an_observer_of_its_own() -> None:
    """From sampled positions: evaluating beside the law does not change what the law does."""
    rows = closed_loop.holding(np.array([[0.5], [0.0]]), 2000.0).rows
    measured_at = [
        Measurement(
            np.array([0.001 * k]),
            np.array([[0.5], [1e-4 * k]]),
            np.array([0.004 * (k // 4)]),
            np.zeros((2, 1)),
            np.full((4, 1), 4e5),
            np.zeros((2, 1)),
            sampled=True,
        )
        for k in range(20)
    ]
    alone, beside = BacksteppingController(), BacksteppingController()
    function = LyapunovFunction(beside)
    for signal in measured_at:
        function.evaluate(signal, Reference(rows))
        np.testing.assert_array_equal(alone.command(signal, Reference(rows)), beside.command(signal, Reference(rows)))
    after = function.evaluate(measured_at[-1], Reference(rows)).value
    function.reset()
    assert not np.array_equal(function.evaluate(measured_at[-1], Reference(rows)).value, after)
