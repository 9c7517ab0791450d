"""Controllers and hands of a user's own: whatever Python can call, by one rule for command and Python."""

import functools

import gymnasium
import numba
import numpy as np
import pytest

from baselines import evaluate
from baselines.named import make_controller
from birthsim_env import Parameters
from birthsim_env.parts.callables import arguments_of

SOURCE = """
import functools
import numba
import numpy as np
from baselines.named import make_controller

def law(seen, asked):
    return np.zeros((4, seen.position.shape[1]))
def with_gain(measurement, reference, gain=1.0):
    return gain * law(measurement, reference)
def defaults(measurement, reference=None):
    return law(measurement, reference)
def star(*signals):
    return law(*signals)
half = functools.partial(with_gain, gain=0.5)
plain = lambda m, r: law(m, r)

class PD:
    calls = 0
    def command(self, measurement, reference):
        self.calls += 1
        return law(measurement, reference)
    def reset(self, lanes=None):
        self.calls = 0

class OfRig(PD):
    def __init__(self, rig, gain=1.0):
        self.mass = rig.mechanics.mass

class Whole(PD):
    def reset(self):
        self.calls = 0

class Callable:
    def __call__(self, seen, asked):
        return law(seen, asked)

ready, bound, called = PD(), PD().command, Callable()
def make(rig, gain=2.0):
    return OfRig(rig, gain)
def make_law(rig):
    return law
def make_named(rig):
    return make_controller("pid", rig)
make_partial = functools.partial(make, gain=3.0)

three = 3
def raises(m, r):
    raise KeyError("pressure")
def one_signal(m):
    return law(m, None)
def needs_keyword(m, r, *, gain):
    return law(m, r)
class NoReset:
    def command(self, measurement, reference):
        return law(measurement, reference)
def makes_nothing(rig):
    return None
"""
TAKEN = (
    *("law", "with_gain", "defaults", "star", "half", "plain", "PD", "OfRig", "Whole", "Callable", "ready", "bound", "called"),
    *("make", "make_law", "make_named", "make_partial"),
)
REFUSED = ("three", "one_signal", "needs_keyword", "NoReset", "makes_nothing")


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "own.py"
    path.write_text(SOURCE)
    return path


def run(law):
    return evaluate("BirthSIM/Probe-v3", law, "own", episodes=2, seed=0, progress=False, duration=0.01).lost


@pytest.mark.parametrize("name", TAKEN)
def test_a_controller_is_whatever_commands_or_makes_what_does(own, name):
    assert run(make_controller(f"{own}:{name}", Parameters())) == [False, False]


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_controller_is_refused_with_what_is(own, name):
    with pytest.raises(ValueError, match=r"allowed: an object with command.* and reset\(\), a function law\(") as caught:
        make_controller(f"{own}:{name}", Parameters())
    assert f"own.py:{name}" in str(caught.value)


def test_a_law_that_fails_is_named(own):
    with pytest.raises(ValueError, match=r"controller 'own': command\(\) fails \(KeyError: 'pressure'\)"):
        run(make_controller(f"{own}:raises", Parameters()))


def test_options_go_to_what_takes_them(own):
    make_controller(f"{own}:OfRig", Parameters(), gain=2.0)
    make_controller(f"{own}:make[gain=2]", Parameters())
    for name in ("law", "ready", "half", "make_law"):
        with pytest.raises(ValueError, match=r"gain = 2 is unknown; allowed for .*: no options"):
            make_controller(f"{own}:{name}", Parameters(), gain=2)


def test_a_reset_without_lanes_is_called_where_all_lanes_begin(own):
    law = make_controller(f"{own}:Whole", Parameters())
    law.controller.calls = 5
    law.reset(np.array([True, False]))
    assert law.controller.calls == 5
    law.reset()
    assert law.controller.calls == 0


HANDS = {
    "of time": (lambda t: (t, 0.0), False),
    "with a default": (lambda t, gain=1.0: (gain * t, 0.0), False),
    "of all": (lambda t, position, velocity: (t, 0.0), True),
    "star": (lambda *signals: (signals[0], len(signals) - 3.0), True),
    "partial": (functools.partial(lambda gain, t: (gain * t, 0.0), 1.0), False),
    "vectorized": (np.vectorize(lambda t: (t, 0.0)), False),
    "compiled": (numba.njit(lambda t: (t, 0.0)), False),
    "array": (lambda t: np.array([[t], [0.0]]), False),
}


@pytest.mark.parametrize("name", HANDS)
def test_a_hand_is_any_function_of_one_or_three_arguments(name):
    function, felt = HANDS[name]
    env = gymnasium.make("BirthSIM/Probe-v3", user_force=function).unwrapped
    env.reset(seed=0)
    info = env.step(np.zeros(4))[4]
    assert env.simulation.user_force.closed_loop is felt
    np.testing.assert_allclose(info["user_force"], [0.01, 0.0], atol=1e-12)


@pytest.mark.parametrize("hand", [lambda: (0.0, 0.0), lambda t, x: (0.0, 0.0), lambda t, *, gain: (0.0, 0.0)])
def test_a_hand_of_other_arguments_is_refused(hand):
    with pytest.raises(ValueError, match=r"user_force: a function of . arguments.*; allowed: a function of time"):
        gymnasium.make("BirthSIM/Probe-v3", user_force=hand)


def test_what_does_not_say_what_it_takes_takes_anything():
    assert arguments_of(dict).take(2)
    assert arguments_of(max).take(3)
