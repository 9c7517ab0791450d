"""Hands that move: a sine is its formula, noise has its size and band, the guiding hand is its differential equation."""

import gymnasium
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from birthsim_env.parts.hands.guided import CALM, Guided
from birthsim_env.parts.hands.noise import Noise
from birthsim_env.parts.hands.sine import Sine
from birthsim_env.registry import names

CIRCLE = "BirthSIM/Circle-v2"


def began(hand, lanes=1, seed=0):
    hand.prepare(lanes)
    for lane in range(lanes):
        hand.begin(lane, np.random.default_rng(seed + lane))
    return hand


def test_a_sine_is_one_once_it_has_begun():
    times = np.linspace(0.5, 4.0, 200)[:, None]
    force = began(Sine(20.0, 1.5, 0.3)).force(times, None, None)[:, :, 0]
    wave = 20.0 * np.sin(2 * np.pi * 1.5 * times[:, 0])
    np.testing.assert_allclose(force, np.stack([wave * np.cos(0.3), wave * np.sin(0.3)], axis=1), atol=1e-9)
    assert not began(Sine(20.0, 1.5, 0.3)).force(np.zeros((1, 1)), None, None).any()


def test_noise_has_its_size_and_nothing_outside_its_band():
    lanes, rate = 24, 50.0
    times = np.repeat(10.0 + np.arange(0, 400, 1 / rate)[:, None], lanes, axis=1)
    force = began(Noise(15.0, (0.5, 3.0)), lanes).force(times, None, None)
    sizes = np.sqrt((force**2).sum(axis=1).mean(axis=0))
    # Sines of different frequencies are orthogonal over a long time.
    np.testing.assert_allclose(sizes, 15.0, rtol=0.05)
    window = np.hanning(len(times))[:, None, None]
    power, frequency = np.abs(np.fft.rfft(force * window, axis=0)) ** 2, np.fft.rfftfreq(len(times), 1 / rate)
    outside = (frequency < 0.45) | (frequency > 3.05)
    assert power[outside].sum() < 1e-6 * power.sum()
    assert len({tuple(lane) for lane in force[0].T}) == lanes, "every lane has its own"


def walk(hand, path, speed, times):
    return np.array([hand.force(np.array([[t]]), path(t)[:, None], speed(t)[:, None])[0, :, 0] for t in times])


def minimum_jerk(u):
    u = np.clip(u, 0, 1)
    return 10 * u**3 - 15 * u**4 + 6 * u**5, 30 * u**2 * (1 - u) ** 2


def test_the_guiding_hand_is_a_mass_between_two_springs():
    """Against Radau, while the end effector is led along a wave: steps of 1 ms are of first order."""
    hand, first = began(Guided(1.2, 350.0, lasts=2.0)), np.array([0.5, 0.1])
    grip, damping = hand.GRIP
    arm = 2 * hand.DAMPING * np.sqrt(1.2 * 350.0)
    points = [np.zeros(2), *hand._points[:, :, 0]]

    def path(t):
        return first + 0.01 * np.array([np.sin(3 * t), np.cos(2 * t) - 1])

    def speed(t):
        return 0.01 * np.array([3 * np.cos(3 * t), -2 * np.sin(2 * t)])

    def wanted(t):
        leg = max(0.0, t - CALM) / 2.0
        place = int(leg)
        fraction, slope = minimum_jerk(2 * (leg - place))
        way = points[place + 1] - points[place] if t > CALM else np.zeros(2)
        return first + points[place] + fraction * way, slope * way

    def derivative(t, state):
        where, pace = wanted(t)
        force = grip * (state[:2] - path(t)) + damping * (state[2:] - speed(t))
        return np.concatenate([state[2:], (350.0 * (where - state[:2]) + arm * (pace - state[2:]) - force) / 1.2])

    times = np.arange(0, 5.0, 0.001)
    start = np.concatenate([path(0.0), speed(0.0)])
    exact = solve_ivp(derivative, (0, 5), start, method="Radau", t_eval=times, rtol=1e-8, atol=1e-10, max_step=0.01).y
    expected = grip * (exact[:2] - np.array([path(t) for t in times]).T)
    expected += damping * (exact[2:] - np.array([speed(t) for t in times]).T)
    found = walk(hand, path, speed, times).T
    assert np.abs(expected).max() > 5.0
    np.testing.assert_allclose(found, expected, atol=0.03 * np.abs(expected).max())


def test_asked_again_it_says_the_same_and_a_new_episode_takes_hold_anew():
    hand = began(Guided(), 2)
    place, rest = np.array([[0.5, 0.5], [0.0, 0.1]]), np.zeros((2, 2))
    for t in (0.0, 0.001, 0.002):
        force = hand.force(np.full((1, 2), t), place, rest)
    np.testing.assert_array_equal(hand.force(np.full((1, 2), 0.002), place, rest), force)
    hand.force(np.full((1, 2), 3.0), place, rest)
    hand.begin(1, np.random.default_rng(5))
    later = hand.force(np.array([[3.001, 0.0]]), place + 0.02, rest)
    assert np.abs(later[0, :, 0]).min() > 1.0
    np.testing.assert_array_equal(later[0, :, 1], 0.0)


@pytest.mark.parametrize("name", names("hand"))
def test_every_registered_hand_pushes_as_it_is_and_drawn(name):
    for randomize in (False, True):
        env = gymnasium.make_vec(CIRCLE, num_envs=2, user_force=name, randomize=randomize)
        env.reset(seed=4)
        assert max(np.abs(env.step(np.zeros((2, 4)))[4]["user_force"]).max() for _ in range(250)) > 0.5


@pytest.mark.parametrize("name", ["steps", "sine", "noise", "guided"])
@pytest.mark.parametrize("randomize", [False, True])
def test_every_lane_is_pushed_and_by_a_hand_of_its_own_where_it_draws(name, randomize):
    env = gymnasium.make_vec(CIRCLE, num_envs=3, user_force=name, randomize=randomize, sensors="lab")
    env.reset(seed=4)
    pushed = np.zeros((3, 2))
    for _ in range(250):
        infos = env.step(np.zeros((3, 4)))[4]
        pushed = np.maximum(pushed, np.abs(infos["user_force"]))
    assert pushed.max() > 0.5
    assert len({tuple(lane) for lane in pushed}) == (3 if randomize or name in ("noise", "guided") else 1)
    # What moves all the time is measured all the time.
    assert (infos["since_jump"] > 2.4).all() == (name != "steps")
