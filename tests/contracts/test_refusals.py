"""Every public entry refuses what cannot be in one line: the argument's name and value, and what is allowed."""

import math
import re
from functools import partial

import gymnasium
import numpy as np
import pytest

from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings, override
from baselines import AdmittanceController, BacksteppingController, evaluate, make_controller
from baselines.limiter.controller import PortLimiter
from baselines.rivals.symbolic import symbolic_model
from birthsim_build.code import ptx
from birthsim_env import Circle, ForceProfile, Parameters, Path, Plant, StiffnessSchedule, linearize, normalized_return
from birthsim_env.drawing.rendering import Renderer
from birthsim_env.env import BirthSIMEnv
from birthsim_env.parts.hands.contractions import Contractions
from birthsim_env.parts.hands.noise import Noise
from birthsim_env.parts.hands.pulls import Pulls
from birthsim_env.parts.hands.steps import AlternatingSteps
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.physics.rig.parameters import DECLARED
from birthsim_env.physics.rig.values import shown
from birthsim_env.vector_env import BirthSIMVectorEnv

CIRCLE, PROBE = "BirthSIM/Circle-v2", "BirthSIM/Probe-v3"
NAN, INF = math.nan, math.inf
RIG = Parameters()


def named(controller):
    return make_controller(controller, RIG)


environment = partial(gymnasium.make, CIRCLE)
lanes = partial(gymnasium.make_vec, CIRCLE, num_envs=2)
itself, lanes_themselves = partial(BirthSIMEnv, "circle"), partial(BirthSIMVectorEnv, "circle")
"""Without ``gymnasium.make``, which warns of a render mode first."""
residual_environment = partial(gymnasium.make, "BirthSIM/CircleResidual-v2")
residual_lanes = partial(gymnasium.make_vec, "BirthSIM/CircleResidual-v2", num_envs=2)
gains = partial(make_controller, "admittance[learn=false]", RIG)
evaluation = partial(evaluate, PROBE, named("shut-valves"), "shut-valves", seed=0, progress=False)
linear = partial(linearize, None, (0.5, 0.0))
limits = partial(PortLimiter, named("shut-valves"), RIG)
paid = partial(normalized_return, environment=CIRCLE, total=1.0)
training, residual = partial(override, TrainingSettings()), partial(override, ResidualSettings())


def ranges(**given):
    return environment(randomize=given)


def options(**given):
    return lanes().reset(seed=0, options=given)


def rig(**given):
    return RIG.replace(given)


def beyond(least, most, above, **_):
    """Numbers that are too small or too large for a parameter of the rig."""
    small = (above, least - 1e-3 * max(abs(least), 1e-3))
    return [value for value in (*small, 1.001 * most) if math.isfinite(value)]


def listed_option(controller, **given):
    return named(f"{controller}[{','.join(f'{name}={value}' for name, value in given.items())}]")


def hand(kind, *fixed, **given):
    return gymnasium.make(PROBE, user_force=kind(*fixed, **given)).reset(seed=0)


def path(**given):
    return gymnasium.make(PROBE, reference=Path(**given)).reset(seed=0)


TABLE = [
    # call, argument, values, words of what is allowed
    *(
        row
        for both in (environment, lanes)
        for row in [
            (both, "action_mode", ("voltage", None), "'valve', 'flow'"),
            (both, "valves", ("three",), "'two_valves', 'one_valve'"),
            (both, "sensors", ("magnetic", ["lab"]), "ideal, lab"),
            (both, "randomize", ("all", None, 1), "'plant', 'scenario'"),
            (both, "randomize", ("sensors",), "'honest'"),
            (both, "scenario", ("birth",), "circle, probe"),
            (both, "reference", ("circle", (0.5, 0.0)), "a birthsim_env.Trajectory"),
            (both, "user_force", (30.0, (0.0, 1.0), "soft"), "a birthsim_env.UserForce"),
            (both, "stiffness", ("stiff", INF), "StiffnessSchedule"),
            (both, "parameters", (3,), "the path of a TOML file"),
            (both, "policy_period", (0.0015, 0.0004, 0, -0.01, INF, NAN, "10 ms"), "multiple of the control period 0.001 s"),
            (both, "duration", (0.0, -1, INF, "long"), "positive"),
            (both, "num_threads", (0, -1, 1.5, "2", True), "None or a whole number >= 1"),
            (both, "picture_size", ((319, 480), (640, 239), (7681, 480), (640.5, 480.0), (640,), "640x480", None, (True, 480)),
             "two whole numbers from 320 x 240 to 7680 x 4320 px"),
        ]
    ),
    (lanes, "autoreset_mode", ("never",), "'NextStep', 'SameStep', 'Disabled'"),
    (lanes, "max_episode_steps", (0, -2, 2.5, "3"), "None, -1 (no limit) or a whole number >= 1"),
    (lanes_themselves, "num_envs", (0, -1, 1.5, "2", None), ">= 1"),
    *((kind, "render_mode", ("ascii", "RGB_ARRAY", 1), "'rgb_array'") for kind in (itself, lanes_themselves)),
    (options, "staggered", (1, "yes", None), "True or False"),
    (options, "reset_mask", (np.array([1, 0]), np.array([True]), np.array([False, False])), "(2,) of bool"),
    (ranges, "mechanics.mass", ((5, 2), (2, NAN)), "ordered"),
    (ranges, "mechanics.mass", (4.0, ("a", "b")), "(low, high)"),
    (rig, "mechanics.mass", (0, -3.0, NAN, "heavy", True), "> 0 and <= 1e+20 (kg)"),
    (rig, "mechanics.mass", (0.01,), "at least 0.0294 kg"),
    (partial(rig, **{"friction.law": "elasto_plastic"}), "mechanics.mass", (0.01,), "at least 0.0294 kg"),
    (partial(rig, **{"friction.law": "coulomb"}), "mechanics.mass", (0.9,), "or less friction"),
    (partial(rig, **{"mechanics.mode_frequency": 30.0}), "mechanics.mass", (0.03,), "or less friction"),
    (rig, "friction.law", ("viscous",), "'lugre', 'coulomb', 'elasto_plastic', 'gms'"),
    (rig, "cylinder2.rod_diameter", (0.025,), "less than piston_diameter"),
    (rig, "air.supply_pressure", (1e5,), "more than atmospheric_pressure"),
    (rig, "geometry.k2", (0.2,), "more than 0.22 m"),
    (rig, "geometry.k1", (0.5,), "cylinder 1's length"),
    (rig, "chambers.dead_volume", (4e-6,), "at least 4.91e-06 m3"),
    (partial(rig, **{"cylinder2.piston_diameter": 0.05}), "chambers.dead_volume", (1e-5,), "at least 1.96e-05 m3"),
    (rig, "electronics.transmitter_y", (0.0,), "another place"),
    *((rig, name, beyond(**vars(one)), f"({one.unit})") for name, one in DECLARED.items()),
    (rig, "electronics.acceleration_bandwidth", (39.0,), "0, which is no sensor, or at least 40 Hz"),
    (named, "controller", ("backsteping",), "a registered name, or path/to/file.py"),
    (named, "controller", ("",), "pid, lqr, sliding-mode"),
    (gains, "stiffness", (1.0,), "gain, rest_gain, rest_push, "),
    (gains, "gain", (0.0,), "a positive number"),
    (gains, "yielding", (1.1,), "at most 1"),
    (partial(listed_option, "pid"), "gain", (3.0,), "for pid: bandwidth"),
    (partial(listed_option, "shut-valves"), "gain", (3.0,), "for shut-valves: no options"),
    (partial(listed_option, "backstepping-cartesian"), "weight_compensation", (True,), "cartesian: pneumatic_gain, "),
    (partial(listed_option, "admittance"), "learn", (2.0,), "True or False"),
    (evaluation, "episodes", (0, -3, 2.5), "a whole number >= 1"),
    (Plant, "num_envs", (0, 2.5), "a whole number >= 1"),
    *((kind, "parameters", (42,), "None, a Parameters, a mapping or the path") for kind in (Plant, BacksteppingController)),
    (linear, "friction", ("dry",), "'stuck', 'sliding'"),
    (paid, "environment", ("BirthSIM/Square-v1", "BirthSIM/Circle-v0", "CartPole-v1", None), CIRCLE),
    (paid, "sensors", ("perfect",), "'ideal', 'lab'"),
    (paid, "randomize", ("plant",), "False, True"),
    (paid, "total", (None, "1", True), "a number or an array of numbers"),
    (training, "step", (3,), "environment, algorithm, steps, "),
    (training, "algorithm", ("dqn",), "'ppo', 'recurrent-ppo', 'sac', 'tqc', 'apg'"),
    (training, "steps", (0, -5, 1e6 + 0.5), "a whole number >= 1 and <= "),
    *((training, name, (0, True, "64"), "a whole number >= 1 and <= ") for name in (
        "lanes", "rollout", "epochs", "gradient_steps", "validation_lanes", "validations")),
    (training, "batch", (1, 2.5), "a whole number >= 2 and <= 1048576"),
    (training, "seed", (-1, "one"), "a whole number >= 0 and <= "),
    (partial(training, rollout=65536), "lanes", (65536,), "a product of at most 4194304"),
    *((training, name, (0.0, -0.5, 1.5, NAN, INF, "a"), "a finite number > 0 and <= 1 (-)") for name in (
        "learning_rate", "discount", "gae_lambda")),
    (training, "until", (0.0, -1.0, NAN), "a finite number > 0 and <= 100 (%)"),
    (training, "log_std", ("low", NAN), "a finite number >= -20 and <= 2 (-)"),
    (training, "hidden", ((), (64, 0), (64.5,), (True,), 64), "1 to 8 whole numbers from 1 to 2048"),
    (training, "memory", (-1, 1.5), "a whole number >= 0 and <= 2048"),
    (partial(training, algorithm="sac"), "memory", (8,), ": 0"),
    (partial(training, algorithm="recurrent-ppo"), "memory", (0,), ">= 1"),
    (partial(training, algorithm="recurrent-ppo"), "noise", (0.1,), ": 0.0"),
    (training, "privileged", ("yes",), "True, False"),
    (training, "horizon", (8,), ": 0"),
    (training, "most_cost", (30.0,), ": 0.0"),
    (partial(training, algorithm="apg"), "most_cost", (-1.0, NAN), "a finite number >= 0 and <= 10000 (mm)"),
    (partial(training, algorithm="apg"), "horizon", (-1, 2.5), "a whole number >= 0 and <= "),
    (partial(training, algorithm="apg", horizon=3), "rollout", (16,), "a multiple of the horizon"),
    (partial(training, algorithm="apg"), "memory", (-1, 4096), "a whole number >= 0 and <= 2048"),
    (training, "target", ("wall",), "'spring', 'impedance'"),
    (partial(training, algorithm="ppo"), "target", ("impedance",), "'spring'"),
    (training, "beside", (3,), "ids of residual environments"),
    (partial(training, algorithm="sac"), "beside", (("BirthSIM/ProbeResidual-v3",),), "()"),
    (partial(training, algorithm="apg", beside=("a", "b")), "lanes", (32,), "a multiple of 3"),
    (training, "margin", (-0.1,), ">= 0 and <= 1"),
    (training, "sensors", ("none",), "'ideal', 'lab'"),
    (training, "randomize", ("some",), "'plant', 'scenario'"),
    (training, "environment", (3,), "the id of a residual environment"),
    (residual, "smoothing", (0.3,), "law, impedance, authority, "),
    (residual, "weight_compensation", (True,), "law, impedance, authority, "),
    (Circle, "period", (0,), "other than zero"),
    (path, "length", (-0.05, (-0.05, 0.1)), ">= 0"),
    (partial(path, angle=1.0), "radius", (0.0, (-0.1, 0.1), (0.08, 0.06)), ">= 0.001"),
    (partial(path, begins=2.0), "ends", (1.0,), "begins = 2.0"),
    (StiffnessSchedule, "times", ((), (1.0,)), "starting at 0"),
    (StiffnessSchedule, "times", ((0.0, 1.0),), "as many setpoints as times"),
    (StiffnessSchedule, "transition", (0.0, -0.5, NAN), ">= 0.001"),
    (partial(hand, ForceProfile), "knots", ([(1, 0, 0), (0, 0, 0)], [(0, NAN, 0)]), "increasing"),
    (partial(hand, ForceProfile), "knots", ([(0, 1)], [(0, "a", 0)]), "(time, Fx, Fy)"),
    (partial(hand, Pulls, (100.0,)), "rate", (0.0, (-10.0, 50.0)), ">= 1"),
    (partial(hand, Ramp), "angle", ("along x",), "'axes'"),
    (partial(hand, Ramp), "rise", (-0.5,), ">= 0"),
    (partial(hand, Ramp), "amplitude", ((40.0, 5.0),), "ordered"),
    (partial(hand, AlternatingSteps), "ramp", (1.5,), "<= 0.3"),
    (partial(hand, Noise, 15.0), "band", ((0.0, 1.0), (2.0, 1.0)), "> 0"),
    *(
        row
        for both in (residual_environment, residual_lanes)
        for row in [
            (both, "action_mode", ("flow", "valve"), "not given"),
            (both, "valves", ("one_valve",), "not given"),
            (both, "actuation", (None,), "not given"),
            (both, "authority", (0.0, 500.1, NAN, "40"), "more than 0, at most 500"),
            (both, "time_constant", (0.0, 1.5), "more than 0, at most 1"),
            (both, "law", ("pid", None), "'backstepping', "),
            (both, "impedance", ("soft",), "'fixed', 'variable_kp', 'variable'"),
            (partial(both, law="none"), "impedance", ("variable",), "'fixed', law = 'none' has no impedance"),
            (partial(both, law="admittance"), "impedance", ("variable_kp",), "'fixed', law = 'admittance' has no impedance"),
            (both, "policy_period", (0.0105,), "a multiple of the control period 0.001 s"),
            (both, "policy_period", (-0.01, "fast"), "more than 0"),
            (both, "sensors", ("none",), "ideal, lab"),
        ]
    ),
    (AdmittanceController, "identified", (True,), "force_sensor is False"),
    (BacksteppingController, "valves", ("three",), "two_valves, one_valve"),
    (limits, "capacity", (0.0, NAN), "a finite number > 0 (J)"),
    (limits, "speed", (-1.0, "fast"), "a finite number > 0 (m/s)"),
    (partial(Renderer(RIG, 320, 240).show, None), "frames_per_second", (0.0, -1.0, NAN, INF), ""),
    (partial(ptx.assemble, "code.ptx", "code.cubin"), "gpu", ("h100",), "sm_"),
    (symbolic_model, "algebra", ("maple",), "'sympy', 'casadi'"),
    *((Contractions, name, (NAN,), "a finite number") for name in ("amplitude", "push", "heading")),
]  # fmt: skip


def title(call):
    inner = call.args[0] if isinstance(call, partial) and call.args else getattr(call, "func", call)
    return getattr(inner, "__name__", inner if isinstance(inner, str) else type(inner).__name__)


CASES = [
    pytest.param(call, name, value, words, id=f"{title(call)}-{name}-{value!r}")
    for call, name, values, words in TABLE
    for value in values
]


@pytest.mark.parametrize(("call", "name", "value", "words"), CASES)
def test_a_refusal_names_the_argument_its_value_and_what_is_allowed(call, name, value, words):
    with pytest.raises(ValueError, match="allowed") as caught:
        call(**{name: value})
    message = str(caught.value)
    said, _, allowed = message.partition("allowed")
    given = rf"\b{re.escape(name.rpartition('.')[2])}('\])? = {re.escape(shown(value))}"
    assert re.search(given, said), message
    assert words in allowed, message
    assert "\n" not in message
