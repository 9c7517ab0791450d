"""An energy tank and a speed limit around any law."""

import math

import gymnasium
import numpy as np
import pytest

from baselines.driving import CompiledDriving, Driving, driving
from baselines.limiter.controller import PortLimiter
from baselines.named import bare_name, known_options, make_controller
from birthsim_env import Measurement, Parameters
from birthsim_env.loop.rows import Signals, fill_measurement
from lab.studies.haptics.worlds import resting
from lab.studies.stability.maps import Cases, judge

RIG = Parameters()
T = RIG.electronics.control_period
KX, MASS = 2000.0, 4.0


class Full:
    def command(self, measurement, reference):
        return np.ones((4, measurement.position.shape[1]))

    def reset(self, lanes=None):
        self.forgotten = lanes


def seen(time, position, velocity, force, late=0.0):
    """A measurement of lanes that move along x about (0.5, 0)."""
    lanes, zero = np.size(position), np.zeros(np.size(position))
    place = np.array([0.5 + position, zero])
    clock = np.full(lanes, time)
    return Measurement(
        clock,
        place,
        clock - late,
        np.array([np.ones(lanes) * velocity, zero]),
        np.full((4, lanes), 4e5),
        np.array([np.ones(lanes) * force, zero]),
        late > 0,
    )


def signals_of(measurement, reference):
    seen = Signals(np.zeros((Signals.size, measurement.position.shape[1])))
    fill_measurement(seen.rows, measurement)
    seen.reference.rows[:] = reference.rows
    return seen


def targets(lanes=1):
    return resting([(0.5, 0.0)] * lanes, [KX] * lanes)


def run(damping, limiter, seconds=6.0):
    """A mass on the spring that is asked for, with ``damping`` (N s/m), pushed to and fro: least authority, and at the end."""
    w, place, speed, least = 2 * math.pi * 1.0, 0.0, 0.0, 1.0
    for k in range(round(seconds / T)):
        force = 30.0 * math.sin(w * k * T)
        limiter.command(seen(k * T, np.array([place]), speed, force), targets())
        least = min(least, float(limiter.authority.min()))
        speed += T * (force - damping * speed - KX * place) / MASS
        place += T * speed
    return least, float(limiter.authority[0])


def test_a_spring_with_a_damper_keeps_its_authority_and_one_that_gives_energy_loses_it():
    assert run(60.0, PortLimiter(Full(), RIG)) == (1.0, 1.0)
    least, _ = run(-20.0, PortLimiter(Full(), RIG), 3.0)
    assert least == 0.0
    assert run(-20.0, PortLimiter(Full(), RIG, capacity=math.inf), 3.0) == (1.0, 1.0)


@pytest.mark.slow
def test_a_stiffer_spring_that_is_asked_for_is_paid_by_who_asks():
    """Held 20 mm out while the setpoint doubles, then let back: the hand gets 0.8 J of which it gave 0.4 J."""
    limiter, ends = PortLimiter(Full(), RIG, speed=math.inf), []
    for soften in (1.0, 2.0):
        limiter.reset()
        for k in range(4000):
            place = 0.02 * (min(k, 1000) / 1000 if k < 3000 else (4000 - k) / 1000)
            stiffness = KX if k < 2000 else KX * soften
            speed = 20.0 * T * (float(k < 1000) - float(k >= 3000))
            force = stiffness * place + 60.0 * speed
            limiter.command(seen(k * T, np.array([place]), speed, force), resting([(0.5, 0.0)], [stiffness]))
        ends.append(limiter.authority[0])
    assert ends == pytest.approx([1.0, 1.0])


def test_beyond_the_speed_the_valves_drive_against_the_motion():
    limiter, target = PortLimiter(Full(), RIG, capacity=math.inf, speed=0.5), targets()
    assert (limiter.command(seen(0.0, np.zeros(1), 0.5, 0.0), target) == 1.0).all()
    away = limiter.command(seen(T, np.zeros(1), 1.0, 0.0), target)[:, 0]
    back = limiter.command(seen(2 * T, np.zeros(1), -1.0, 0.0), target)[:, 0]
    # Cylinder 2 points along x at this pose: its chamber P, which pushes outwards, is emptied.
    assert (away[2], away[3]) == (-1.0, 1.0)
    np.testing.assert_array_equal(away, -back)


def test_without_limits_a_law_is_itself_to_the_last_bit():
    free = PortLimiter(make_controller("backstepping", RIG), RIG, capacity=math.inf, speed=math.inf)
    law = make_controller("backstepping", RIG)
    for k in range(50):
        now, target = seen(k * T, np.array([0.001, -0.002]) * k / 50, 0.6, np.array([20.0, -20.0])), targets(2)
        np.testing.assert_array_equal(free.command(now, target), law.command(now, target))


@pytest.mark.parametrize("law", ["backstepping", "pid"])
def test_a_compiled_loop_and_calls_once_a_period_give_the_same_bits(law):
    ends = []
    for called in (False, True):
        limiter = PortLimiter(make_controller(law, RIG), RIG)
        drives = Driving(limiter, law, {}) if called else driving(limiter, law)
        assert type(drives) is (Driving if called else CompiledDriving)
        env = gymnasium.make_vec("BirthSIM/Forceps-v2", num_envs=3, sensors="lab", policy_period=T, actuation=drives)
        env.reset(seed=1)
        for _ in range(4000):
            env.unwrapped.simulation.step(env.unwrapped.simulation.action)
        assert limiter.authority.min() < 1.0
        ends.append(np.concatenate(env.unwrapped.simulation.rows()))
    np.testing.assert_array_equal(*ends)


def test_a_law_that_returns_no_openings_is_refused_by_name():
    law = Full()
    law.command = lambda measurement, reference: None
    with pytest.raises(ValueError, match=r"controller 'Full': command\(\) returned None.*; allowed: spool openings"):
        PortLimiter(law, RIG).command(seen(0.0, np.zeros(1), 0.0, 0.0), targets())


def test_a_name_puts_any_law_behind_the_limits():
    law = make_controller("limited:pid[bandwidth=50]", RIG)
    assert isinstance(law, PortLimiter)
    assert known_options("limited:pid") == known_options("pid")
    assert bare_name("limited:mine.py:Mine[gain=2]") == "mine.py:Mine"


@pytest.mark.slow
def test_a_clamp_that_swings_with_the_papers_law_gets_no_energy_behind_the_limits():
    """20 kN/m, lab sensors: joules without the limits, see docs/laboratory/haptics.md; with them what docs/limits.md allows."""
    case = Cases([RIG], np.array([20000.0]), np.array([KX]), np.zeros(1), np.zeros(1))
    bare = judge(case, make_controller("backstepping", RIG), "lab", 0, None)
    limited = judge(case, make_controller("limited:backstepping", RIG), "lab", 0, None)
    assert bare.energy[0] > 1.0
    assert limited.energy[0] < 0.05
    assert limited.motion[0] < 0.1 * bare.motion[0]
