"""The labour model of the example against closed forms and SciPy's integrators; its file."""

import math
from dataclasses import replace
from runpy import run_path

import gymnasium
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from birthsim_env.parts.own_parts import stiffness_of, trajectory_of
from birthsim_env.parts.references import Path
from tests.console import ROOT

Labour = run_path(f"{ROOT}/examples/labour.py")["Labour"]
FASTER = 25.0
EVEN = replace(Labour(), floor_yield_force=35.0, floor_stiffness=3500.0, outlet=10.0)
"""The same tissue everywhere."""


def reached(labour, force, lasts=20.0, steps=200):
    return labour.progress(np.linspace(0, lasts, steps + 1), np.full(2 * steps + 1, force))


def test_pressures_peak_as_they_should_and_end():
    labour = Labour()
    time = np.linspace(0, 150, 150001)
    pressure = labour.pressure(time)
    assert pressure.max() == pytest.approx(16e3, rel=1e-9), "the middle one of three pushes meets the contraction's peak"
    assert labour.force(time).max() == pytest.approx(16e3 * math.pi * 0.0475**2, rel=1e-9)
    assert not pressure[time >= 60].any()
    pushed = pressure - 8e3 * np.where(time < 60, np.sin(np.pi * time / 60) ** 4, 0)
    np.testing.assert_allclose(pushed[[16000, 30000, 44000]], 8e3)  # middles of pushes of 10 s, 4 s apart, about 30 s
    assert not labour.pressure(np.array([900.0, 930.0, 1000.0])).any()
    # The mean of sin^4 is 3/8.
    assert np.trapezoid(pressure, time) == pytest.approx(3 / 8 * (8e3 * 60 + 3 * 8e3 * 10), rel=1e-6)


def test_constant_pressure_moves_the_head_at_constant_speed():
    """g(x) = x^3 / (x^2 + w^2) over the damping, whatever the step."""
    for force in (36.0, 60.0, 113.0):
        spare = force - 35.0
        speed = spare**3 / (spare**2 + 5.0**2) / EVEN.damping
        np.testing.assert_allclose(reached(EVEN, force), np.linspace(0, 20 * speed, 201), rtol=1e-12, atol=1e-15)


def test_less_than_the_tissue_bears_moves_nothing_and_more_ends_where_it_is_borne():
    labour = Labour()
    assert not reached(labour, 35.0).any()
    # 50 N: held where the rise to the pelvic floor bears 50 N; the step is 10 u^3 - 15 u^4 + 6 u^5.
    u = next(root.real for root in np.roots([6, -15, 10, 0, 0, -(50 - 35) / (60 - 35)]) if root.imag == 0 and 0 < root.real < 1)
    # The last of it goes with the cube of the distance, which therefore falls with the root of time.
    assert reached(labour, 50.0, 4e3, 4000)[-1] == pytest.approx(0.05 + u * 0.06, abs=1e-2)
    assert reached(labour, 100.0, 4e3, 4000)[-1] == pytest.approx(0.165 + 40 / 2e4, abs=1e-3), "held at the outlet"


def test_progress_is_what_scipy_integrates():
    labour = Labour()
    time = np.linspace(0, 150, 1501)
    ours = labour.progress(time, labour.force(np.linspace(0, 150, 3001)))

    solved = {"rtol": 1e-10, "atol": 1e-12, "max_step": 0.5}
    theirs = solve_ivp(lambda t, p: labour.rate(p, labour.force(np.array([t]))), (0, 150), [0.0], "DOP853", time, **solved).y[0]
    assert np.abs(ours - theirs).max() < 1e-7
    assert (np.diff(ours) >= 0).all()


def test_the_axis_is_a_line_and_an_arc_with_continuous_curvature():
    labour = Labour()
    along = np.linspace(0.0, 0.2, 2001)
    points = labour.position(along)

    def gone(s, function):
        return quad(lambda t: function(labour._turned(np.array([t]))[0]), 0, s, epsabs=1e-13, points=(0.1, 0.12))[0]

    for s in (0.05, 0.1, 0.11, 0.13, 0.2):
        expected = 0.42 + gone(s, math.cos), -0.04 + gone(s, math.sin)
        np.testing.assert_allclose(labour.position(np.array([s]))[:, 0], expected, atol=1e-12)
    np.testing.assert_allclose(np.hypot(*np.diff(points, axis=1)), 1e-4, rtol=1e-6)
    turned = labour._turned(along)
    curvature = np.gradient(turned, along)
    assert curvature[:990] == pytest.approx(0.0, abs=1e-9)
    assert curvature[1210:-1] == pytest.approx(1 / 0.07, rel=1e-9)
    assert np.abs(np.diff(curvature)).max() < 1.9 / 0.07 * 1e-4 / 0.02, "the minimum-jerk step's steepest slope is 1.875"
    # With a short blend it is the built-in path.
    sharp, path = replace(labour, blend=1e-6), Path((0.42, -0.04), 0.0, 0.1, 0.07, math.radians(80), ends=1.0)
    path.prepare(1), path.begin(0, None)
    for u in (0.3, 0.5, 0.7):
        share = 10 * u**3 - 15 * u**4 + 6 * u**5
        there = sharp.position(np.array([share * (0.1 + 0.07 * math.radians(80))]))[:, 0]
        np.testing.assert_allclose(there, path.sample(np.array([u]))[:2, 0], atol=1e-6)


def test_the_motion_is_twice_differentiable():
    """Halving the grid halves the jumps of what is continuous: of velocity and acceleration, over the whole labour."""
    reference, _ = Labour().parts(FASTER)
    steps = []
    for count in (36001, 72001):
        motion = reference.sample(np.linspace(0, 36, count))
        steps.append(np.abs(np.diff(motion[2:6], axis=1)).max(axis=1))
    assert (steps[1] < 0.55 * steps[0]).all()


def test_one_file_is_reference_and_stiffness(tmp_path):
    labour, file = Labour(contractions=2), tmp_path / "labour.csv"
    labour.write(file, FASTER)
    reference, stiffness = labour.parts(FASTER)
    times = np.linspace(-1, 14, 400)
    np.testing.assert_array_equal(trajectory_of(file, 12.0).sample(times), reference.sample(times))
    schedules = stiffness, stiffness_of(str(file))
    for schedule in schedules:
        schedule.prepare(400), schedule.begin(np.arange(400), np.random.default_rng(0))
    np.testing.assert_array_equal(schedules[0].sample(times), schedules[1].sample(times))
    asked = schedules[0].sample(np.array([0.0, 12.0] * 200))[0]
    assert asked[0] == 3500.0
    assert abs(asked[1] - labour.course(FASTER)[-1, 3]) < 250.0
    env = gymnasium.make("BirthSIM/Probe-v3", reference=file, stiffness=file, user_force=None)
    env.reset(seed=0)
    np.testing.assert_allclose(env.unwrapped.reference.position, (0.42, -0.04))
