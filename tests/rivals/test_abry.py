"""The law of Abry et al.: stiffness and damping that a hand feels, measured on the simulated plant, not by its formulas."""

import math

import numpy as np
import pytest

import birthsim
from baselines.bench.probes import run_stiffness_test
from baselines.named import make_controller
from baselines.rivals.abry import AbryController
from birthsim_env.loop.signals import Reference
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop
from tests.oracles.closed_loop import IDEAL, resting_at

TILT = math.radians(30.0)
ALONG = np.array([[math.cos(TILT)], [math.sin(TILT)]])
RAIL = IDEAL.replace({"linkage.kind": "rail", "linkage.inclination": TILT})
"""One cylinder without dry friction, with linear valves."""

MASS = RAIL.mechanics.mass

VALVES = pytest.mark.parametrize("name", ["abry", "abry-one-valve"])


def holding(stiffness: Array) -> Reference:
    """At rest at mid stroke of the rail, a lane for each of ``stiffness``, N/m."""
    return closed_loop.holding(0.5 * ALONG * np.ones(len(stiffness)), stiffness)


def pushed(law: AbryController, asked: Reference, factor: Array, push, seconds: float) -> Array:
    """Displacements along the rail, m, (periods, lanes), under ``push(time)`` N outward."""
    plant, path = resting_at(asked, RAIL), list[Array]()
    lanes = asked.rows.shape[1]
    for _ in closed_loop.run(
        plant,
        lambda seen, wanted: law.command(seen, wanted, damping_factor=factor),
        lambda t: asked,
        lambda t: ALONG * push(t) * np.ones(lanes),
        seconds,
    ):
        path.append((ALONG * plant.end_effector()[:2]).sum(axis=0) - 0.5)
    return np.array(path)


@VALVES
@pytest.mark.parametrize("ratio", [0.3, 0.7, 1.5])
def test_a_static_push_finds_the_stiffness_whatever_the_damping(name: str, ratio: float) -> None:
    """(15) for one cylinder, by finite differences: the way between pushes of 8 and 10 N, a lane for each setpoint."""
    setpoints = np.array([800.0, 1500.0, 3000.0])
    law = make_controller(name, RAIL, damping_ratio=ratio)
    path = pushed(law, holding(setpoints), np.zeros(3), lambda t: 8.0 * min(t, 1.0) + 2.0 * (t > 3.0), 5.0)
    np.testing.assert_allclose(2.0 / (path[4999] - path[2999]), setpoints, rtol=2e-3)


@VALVES
def test_slow_pushes_find_damping_and_stiffness_that_are_asked_for(name: str) -> None:
    """Frequency response of a push of 4 N at 0.5 Hz: its part in phase is K less what masses take, that in quadrature B w.

    Lanes have their own stiffness and their own damping at once, as both are set while it runs.
    """
    setpoints, factors = np.array([1000.0, 1000.0, 1000.0, 3000.0, 3000.0]), np.array([0.5, 1.0, 2.5, 0.7, 1.5])
    law, rate = make_controller(name, RAIL, damping_ratio=0.8), 2 * np.pi * 0.5
    path = pushed(law, holding(setpoints), factors, lambda t: 4.0 * math.sin(rate * t), 6.0)[2000:6000]
    times = 1e-3 * np.arange(2001, 6001)
    felt = 4.0 / (2 * np.mean(path * 1j * np.exp(-1j * rate * times)[:, None], axis=0))
    damping = 2 * 0.8 * factors * np.sqrt(MASS * setpoints)
    np.testing.assert_allclose(felt.imag / rate, damping, rtol=0.04)
    carried = (setpoints - felt.real) / (MASS * rate**2)
    assert 0.8 < carried.min() < carried.max() < 1.5


def test_what_it_declares_is_the_series_of_what_a_hand_feels() -> None:
    """Along the rail up to 2 Hz, in magnitude and phase, where a mass of 3 kg takes a third of the stiffness."""
    asked, law = holding(np.array([1000.0])), AbryController(RAIL)
    frequencies = np.array([0.5, 1.0, 2.0])
    declared = law.declared_impedance(asked)
    drag = RAIL.cylinder2.viscous_friction
    c = 2.0 * declared.damping[0, 0, 0] / MASS
    for frequency in frequencies:
        rate = 2 * np.pi * frequency
        path = pushed(law, asked, np.zeros(1), lambda t, rate=rate: 4.0 * math.sin(rate * t), 6.0)[2000:6000, 0]
        felt = 4.0 / (2 * np.mean(path * 1j * np.exp(-1j * rate * 1e-3 * np.arange(2001, 6001))))
        said = complex(np.einsum("ia,fijn,ja->fn", ALONG, declared.at(np.array([frequency])), ALONG)[0, 0])
        assert abs(felt / said - 1) < 0.06, frequency
        law.reset()
    assert 0 < declared.mass[0, 0, 0] < MASS * (1 + drag / (MASS * c))


def test_stiffness_and_damping_change_under_a_push_without_a_shock() -> None:
    """10 N hold while stiffness doubles, then while damping triples: the way halves without overshoot, then nothing moves."""
    law, soft, stiff = AbryController(RAIL, damping_ratio=1.0), holding(np.array([1000.0])), holding(np.array([2000.0]))
    plant, path = resting_at(soft, RAIL), list[float]()
    for time, *_ in closed_loop.run(
        plant,
        lambda seen, wanted: law.command(seen, wanted, damping_factor=np.full(1, 1.0 if seen.time[0] < 4.0 else 3.0)),
        lambda t: soft if t < 2.0 else stiff,
        lambda t: 10.0 * ALONG * min(t, 1.0),
        6.0,
    ):
        del time
        path.append(float((ALONG * plant.end_effector()[:2]).sum()) - 0.5)
    np.testing.assert_allclose([path[1999], path[3999]], [0.01, 0.005], rtol=5e-3)
    later = np.array(path[2000:4000])
    assert later.min() > 0.98 * path[3999]
    assert later.max() < 1.01 * path[1999]
    np.testing.assert_allclose(path[4000:], path[3999], rtol=0.01)


def test_the_pneumatic_stiffness_changes_without_moving_the_carriage() -> None:
    """The two virtual flows are decoupled: K of (9), from the pressures, goes to its setpoint, while a push of 10 N holds."""
    law, before, after = AbryController(RAIL), holding(np.array([2000.0])), holding(np.array([2000.0]))
    before.rows[11], after.rows[11] = 1700.0, 2500.0
    plant, path, stiffness = resting_at(before, RAIL), list[float](), list[float]()
    areas, half = np.array([RAIL.cylinder2.area_p, RAIL.cylinder2.area_n]), RAIL.cylinder2.stroke / 2
    for time, *_ in closed_loop.run(
        plant, law.command, lambda t: before if t < 2.5 else after, lambda t: 10.0 * ALONG * min(t, 1.0), 4.0
    ):
        path.append(float((ALONG * plant.end_effector()[:2]).sum()) - 0.5)
        lengths = np.array([half + path[-1], half - path[-1]])
        stiffness.append(RAIL.air.polytropic_index * float((plant.pressures[2:, 0] * areas / lengths).sum()))
        assert time < 1.5 or abs(path[-1] - 0.005) < 1e-4
    np.testing.assert_allclose([stiffness[2499], stiffness[3999]], [1700.0, 2500.0], rtol=0.02)


@pytest.mark.parametrize("ratio", [0.7, 1.4])
def test_two_cylinders_find_a_coupled_stiffness_at_any_pose(ratio: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pushes of 6 N either way along both axes at five poses: what way each makes along both, the means of both ways."""
    closed_loop.shorten_probes(monkeypatch)
    probes = closed_loop.pushes((6.0, -6.0), setpoints=(2000.0,), rigs=(IDEAL,))
    probes.stiffness[1], probes.stiffness[2] = 3000.0, 800.0
    answers = run_stiffness_test(probes, make_controller("abry", IDEAL, damping_ratio=ratio))
    expected = np.linalg.solve([[2000.0, 800.0], [800.0, 3000.0]], probes.force)
    error = (answers.displacement - expected).reshape(2, -1, 2) * np.sign(probes.force.sum(axis=0)).reshape(-1, 2)
    assert np.abs(error.mean(axis=2)).max() < 0.01 * np.abs(expected).max()
    assert answers.hunting.max() < 1e-5


def test_the_one_valve_gives_opposite_openings() -> None:
    law, asked = make_controller("abry-one-valve", RAIL), holding(np.array([2000.0]))
    openings = [u for *_, u in closed_loop.run(resting_at(asked, RAIL), law.command, lambda t: asked, lambda t: 9 * ALONG, 0.3)]
    assert np.ptp(openings) > 0.05
    np.testing.assert_array_equal(np.array(openings)[:, 1::2], -np.array(openings)[:, ::2])


def test_friction_spoils_its_stiffness_less_than_that_of_the_papers_law() -> None:
    """32 drawn benches with encoders, pushed with 5 to 40 N: a quarter of the paper's error, which carries the weight too."""
    rig = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": TILT})
    still, push = birthsim.FixedTarget((0.5 * math.cos(TILT), 0.5 * math.sin(TILT))), Ramp((5.0, 40.0), TILT, 3.0)
    own, papers = (
        np.median(
            np.abs(
                birthsim.evaluate(
                    "BirthSIM/Rail-v0", name, episodes=32, seed=40, progress=False, parameters=rig, sensors="encoders",
                    randomize=True, reference=still, user_force=push, duration=7.0,
                ).metrics["stiffness_error"]
            )
        )
        for name in ("abry", "backstepping-weight")
    )  # fmt: skip
    assert own < 0.25 * papers


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"damping_ratio": 0.0}, ("damping_ratio", "0.0", "0.05")),
        ({"force_ratio": 1.0}, ("force_ratio", "1.0", "1.01")),
        ({"friction_fraction": -1.0}, ("friction_fraction", "-1.0")),
        ({"pneumatic_gain": math.nan}, ("pneumatic_gain", "nan")),
        ({"valves": "three"}, ("valves", "three", "two_valves, one_valve")),
    ],
)
def test_options_out_of_their_ranges_are_refused_by_name(options: dict, named: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match=named[0]) as refused:
        AbryController(**options)
    assert all(word in str(refused.value) for word in named)


def test_setpoints_that_are_no_spring_or_beyond_the_valves_are_refused() -> None:
    law = AbryController(RAIL)
    plant = resting_at(holding(np.array([2000.0])), RAIL)
    seen = closed_loop.ideal(plant, 0.0, np.zeros((2, 1)))
    for stiffness, allowed in ((-5.0, "more than 0 N/m"), (1e5, "at most 9000 N/m")):
        with pytest.raises(ValueError, match=allowed):
            law.command(seen, holding(np.array([stiffness])))
