"""Calls that are refused in one line beyond single values: shapes, what goes with what, what nothing can serve."""

from runpy import run_path

import gymnasium
import numpy as np
import pytest

from agents.gradients.rollouts import Worlds
from agents.residual.settings import LAWS, ResidualSettings, needs_force
from agents.training.sb3.adapter import SB3VecEnv
from baselines import BacksteppingController, make_controller
from baselines.controller import checked_command
from baselines.identification.experiment import propose
from birthsim_env import Circle, FixedTarget, ForceProfile, Parameters, Path, Plant, StiffnessSchedule, linearize
from birthsim_env.drawing.rendering import Renderer
from birthsim_env.gradients.recorder import Recorder
from birthsim_env.loop.loop import Loop
from birthsim_env.loop.signals import InPlane
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.drawn.seeding import draw
from birthsim_env.parts.drawn.streams import Streams
from birthsim_env.physics.compiled.records import Rows, row, rows
from lab.studies.lyapunov import LyapunovFunction
from tests.oracles.strict_feedback import strict_feedback_rates

CIRCLE = "BirthSIM/Circle-v2"
NAN, INF = float("nan"), float("inf")
RIG = Parameters()
STREAMS = Streams(np.ones(2, dtype=np.uint64), np.zeros(2, dtype=np.int64), "reference")
STILL = np.zeros((4, 2)), np.zeros((2, 2))
PHASES = {"times": (0.0, 1.0), "closed_loop": (2e3, 4e3), "pneumatic1": (4600.0, 3600.0), "pneumatic2": (2300.0, 1800.0)}
HIGH_BELOW = (2e5, 2e5, 6e5, 2e5)


class History(Rows):
    slot = row("1", "the present")
    past = rows(0, "m", "a ring")


class Wrong(ForceProfile):
    def knots(self, rng):
        return [(0.0, 1.0)]


def later(function, *fixed, **always):
    """What makes a call of a function, which is made later: ``fixed`` and ``always`` are given to each."""
    return lambda *given, **named: lambda: function(*fixed, *given, **always, **named)


def reset(*fixed, make=gymnasium.make, seed=0, **given):
    return make(CIRCLE, *fixed, **given).reset(seed=seed)


env, started = later(gymnasium.make, CIRCLE), later(reset)
lanes = later(reset, make=gymnasium.make_vec)
paper, schedule, labour = (
    later(BacksteppingController, RIG),
    later(StiffnessSchedule),
    later(run_path("examples/labour.py")["Labour"]),
)
residual, plant, stage = later(ResidualSettings), later(Plant), later(Stage, lambda *_: 0)


def linear(pose=(0.5, 0.0), parameters=None, **given):
    return lambda: linearize(parameters, pose, **given)


def advanced(opening=STILL[0], force=STILL[1], duration=0.01):
    return lambda: Plant(num_envs=2).advance(opening, force, duration)


def rates(of_state, of_flows):
    return lambda: strict_feedback_rates(np.zeros((of_state, 2)), np.zeros((of_flows, 2)), RIG)


def pullback(changes):
    return Plant(RIG.replace(changes)).vjp(np.zeros((4, 1)), np.zeros((2, 1)), 0.01)


def recorder(**given):
    env = gymnasium.make_vec(CIRCLE, num_envs=2, **given).unwrapped
    env.reset(seed=0)
    return Recorder(env.simulation).prepare()


COMMANDS = (
    (np.zeros(4), "command() returned an array (4,)"),
    ([[0.0] * 2] * 3, "command() returned an array (3, 2)"),
    (None, "command() returned None"),
    ("open", "command() returned 'open'"),
    (np.full((4, 2), np.nan), "command()[0, 0] = nan"),
    (np.full((4, 2), 1.5), "command()[0, 0] = 1.5"),
)
"""What a controller's command returns, and how it is named."""


TABLE = {
    # what is named; what is allowed: the calls
    ("force_first = True", "False with valves = 'one_valve'"): [paper(valves="one_valve", force_first=True)],
    ("law.frozen_friction = True", "False"): [lambda: LyapunovFunction(BacksteppingController(frozen_friction=True))],
    ("'smoothing'", "law, impedance, "): [
        lambda: gymnasium.make("BirthSIM/CircleResidual-v2", smoothing=0.3),
        lambda: gymnasium.make_vec("BirthSIM/CircleResidual-v2", num_envs=3, smoothing=0.3),
    ],
    ("'sensor'", "action_mode, valves, sensors, randomize"): [env(sensor="lab")],
    ("state has shape (7, 2)", "(8, 2)"): [rates(7, 4)],
    ("flows has shape (3, 2)", "(4, 2)"): [rates(8, 3)],
    ("'gain'", "name[gain=60,other=2]"): [lambda: make_controller("pid[gain]", RIG)],
    ("controller = 'nobody'", "backstepping, "): [lambda: make_controller("nobody[gain=3]", RIG)],
    ("controller = 'none'", "backstepping, "): [lambda: make_controller("limited:none", RIG)],
    ("duration = ", ">= 4 and <= 600 (s)"): [later(propose, RIG)(value) for value in (0.0, 3.9, 601.0, NAN)],
    ("informed = 'yes'", "True, False"): [residual(informed="yes")],
    ("env = ", "one made with autoreset_mode='SameStep'"): [
        *(lambda wrapped=wrapped: wrapped(gymnasium.make_vec(CIRCLE, num_envs=2)) for wrapped in (SB3VecEnv, Worlds)),
    ],
    ("range ", "a finite number or (low, high) of such"): [
        lambda bad=bad: draw(bad, np.random.default_rng(0)) for bad in ((2.0, 1.0), (1.0, 2.0, 3.0), (0.0, NAN), ("a", "b"))
    ],
    ("high = ", "2^64 of numpy.uint64"): [
        later(STREAMS.integers)(high, dtype) for high, dtype in ((5, np.uint64), (2**64, int))
    ],
    ("", "float64"): [
        lambda wrong=wrong: Loop(4, [(wrong, 0)], [], [])
        for wrong in (np.zeros((2, 3)), np.zeros((2, 4), dtype=np.float32), np.zeros((4, 2)).T, np.zeros(4))
    ],
    ("tables[0] of a stage is ", "C-contiguous"): [stage(tables=(np.zeros((4, 3)).T,))],
    ("tables[1] of a stage is ", "C-contiguous"): [stage(tables=(np.zeros(3), np.zeros((1,) * 5)))],
    ("constants of a stage is ", "C-contiguous"): [stage(constants=np.zeros(4)[::2]), stage(constants=np.zeros(4, np.float32))],
    ("rows of InPlane have shape (3, 3)", "2"): [lambda: InPlane(np.zeros((3, 3)))],
    ("rows of InPlane have shape (1, 3)", "2"): [lambda: InPlane(np.zeros((1, 3)))],
    ("rows of History have shape (0, 3)", "1"): [lambda: History(np.zeros((0, 3)))],
    ("behind follows a group without a size", ""): [lambda: type("Wrong", (History,), {"behind": row("m", "")})],
    ("size", "other names"): [lambda: type("Wrong", (Rows,), {"size": row("m", "")})],
    ("(319, 240)", "320 x 240"): [lambda: Renderer(RIG, 319, 240)],
    **{
        (f"({x:g}, {y:g}) m is unreachable", "distance 0.3 to 0.7 m from the pivot"): [started(reference=FixedTarget((x, y)))]
        for x, y in ((0.8, 0.0), (0.25, 0.0), (0.5, 0.4), (0.3, -0.5), (-0.5, 0.0))
    },
    ("reference at ", "distance"): [
        lanes(reference=Circle(radius=(0.24, 0.3))),
        *(
            make(reference=path)
            for make in (env, lanes)
            for path in (
                Circle(radius=(0.05, 0.21)), FixedTarget(((0.45, 0.71), 0.0)), FixedTarget((0.5, (-0.5, 0.0))),
                FixedTarget(((0.295, 0.4), (-0.1, 0.2))), Path((0.5, 0.0), 0.0, (0.05, 0.25)),
                Path((0.5, 0.0), (-3.0, 3.0), 0.21, ends=2.0),
            )
        ),
    ],
    ("reference: function(0) = 0.5", "a function of time"): [env(reference=lambda t: 0.5)],
    ("user_force: function(0, ...) = None", "a function of time"): [started(user_force=lambda t: None)],
    ("user_force: a function of 2 arguments", "a function of time"): [env(user_force=lambda time, position: (0.0, 0.0))],
    ("Wrong.knots(rng) = [(0.0, 1.0)]", "(time, Fx, Fy)"): [started(user_force=Wrong())],
    ("times = (0.0,)", "as many setpoints as times"): [schedule(closed_loop=(2e3, 4e3)), schedule(closed_loop_y=(2e3, 4e3))],
    ("times = (0.0, 0.0)", "increasing"): [schedule(**{**PHASES, "times": (0.0, 0.0)})],
    ("times = nan", "finite"): [schedule(**{**PHASES, "times": (0.0, NAN)})],
    ("stiffness setpoint = ", ">= 0.001"): [
        schedule(closed_loop=(0.0,)), schedule(closed_loop=((-1.0, 2000.0),)), schedule(pneumatic2=(NAN,)),
    ],
    ("closed_loop_xy -3000.0", "below sqrt(Kclx Kcly)"): [schedule(closed_loop_xy=(-3000.0,))],
    ("contractions = 0", ""): [labour(contractions=0)],
    ("damping = 0", "more than 0"): [labour(damping=0.0)],
    ("head_diameter = -0.1", ""): [labour(head_diameter=-0.1)],
    ("lasts = 60 s", "from 80 s"): [labour(pushes=6)],
    ("floor_ends = 0.01 m", "more than floor_begins"): [labour(floor_ends=0.01)],
    ("randomize: some of the rigs drawn are impossible: ", ""): [
        *(
            env(randomize=ranges)
            for ranges in (
                {"cylinder1.piston_diameter": (0.02, 0.03), "cylinder1.rod_diameter": (0.01, 0.024)},
                {"cylinder1.piston_diameter": (0.025, 0.045), "chambers.dead_volume": (1e-5, 3e-5)},
                {"air.supply_pressure": (1.5e5, 7e5), "air.atmospheric_pressure": (1e5, 2e5)},
            )
        ),
        env(
            parameters=RIG.replace({"friction.law": "coulomb"}),
            randomize={"mechanics.mass": (2, 5), "cylinder1.coulomb_friction": (5, 30)},
        ),
    ],
    **{
        (f"Mechanics.mass = {mass:g} kg is more than this rig can carry: ", ""): [started(parameters={"mechanics.mass": mass})]
        for mass in (25.0, 400.0)
    },
    ("mechanics.mas", "mass"): [env(randomize={"mechanics.mas": (2, 5)})],
    ("policy_period = 0.01", "control period 0.004 s"): [env(parameters={"electronics": {"control_period": 0.004}})],
    ("motor", "mechanics"): [env(randomize={"motor.mass": (2, 5)})],
    ("did you mean 'mechanics.mass'?", "mechanics"): [env(randomize={"mass": (2, 5)})],
    ("did you mean 'cylinder1.stroke' or 'cylinder2.stroke'?", ""): [env(randomize={"stroke": (1, 2)})],
    ("parameters: a = 1", "a section"): [env(parameters={"a": 1})],
    ("3", ""): [env(randomize={3: (2, 5)})],
    ("Mechanics.mass = 0.0", "> 0"): [env(randomize={"mechanics.mass": (0.0, 3.0)})],
    ("critical_ratio = 0.95", "0.9"): [env(randomize={"valves.critical_ratio": (0.2, 0.95)})],
    ("friction.law", "'lugre', 'coulomb'"): [env(randomize={"friction.law": of}) for of in (("coulomb", "ice"), ())],
    **{
        # Drawing what all lanes share would change nothing, or put the end effector beside its target.
        (f"randomize['{name}']", ""): [env(randomize={name: (0.1, 0.4)})]
        for name in (
            *("geometry.k2", "cylinder1.stroke", "cylinder2.stroke"),
            *("mechanics.impact_speed", "electronics.position_noise"),
        )
    },
    ("randomize['electronics.force_bias']", "other sensors"): [
        env(sensors="lab", randomize={"electronics.force_bias": (0.0, 5.0)}),
    ],
    ("randomize['electronics.control_period']", ""): [
        env(sensors="honest", randomize={"electronics.control_period": (0.001, 0.002)}),
    ],
    ("supply_pressure", ""): [
        env(parameters=RIG.replace({"air.supply_pressure": 1.5e5}), randomize={"air.atmospheric_pressure": (1.0e5, 1.9e5)}),
    ],
    ("mechanics.mode_frequency", "at their defaults"): [
        later(pullback)({name: value}) for name, value in (("air.supply_conductance", 1e-8), ("mechanics.mode_frequency", 20.0))
    ],
    ("user's own part", ""): [later(recorder)(user_force=lambda time: (0.0, 0.0))],
    ("valves.hysteresis", ""): [
        later(pullback)({"valves.hysteresis": 0.1}), later(recorder)(randomize={"valves.hysteresis": (0.01, 0.02)}),
    ],
    **{
        (f"controller 'mine': {words}", "an array (4, 2)"): [later(checked_command, "mine")(returned, 2)]
        for returned, words in COMMANDS
    },
    ("seed", ""): [lanes(num_envs=3, seed=seed) for seed in ([1, 2], [1, -2, 3], [1, 2.5, 3], ["a", "b", "c"], 1.5, "abc")],
    ("parameters has 3 entries", "2 lanes"): [plant(parameters=[RIG] * 3, num_envs=2)],
    ("parameters[1] = 7", "a Parameters"): [plant(parameters=[RIG, 7], num_envs=2)],
    ("state has shape (17, 2)", "(18, 2)"): [lambda: Plant(num_envs=2).derivatives(np.zeros((17, 2)), *STILL)],
    ("state[0, 0] = nan", ""): [lambda: Plant(num_envs=2).derivatives(np.full((18, 2), NAN), *STILL)],
    ("opening_command reaches 1.5", "-1 to 1"): [advanced(STILL[0] + 1.5)],
    ("opening_command[0, 0] = nan", "finite"): [advanced(STILL[0] * NAN)],
    ("opening_command has shape (4,)", "(4, 2)"): [advanced(np.zeros(4))],
    ("opening_command = 'wide'", "numbers"): [advanced("wide")],
    ("user_force[0, 0] = inf", "finite numbers (N)"): [advanced(force=STILL[1] + INF)],
    ("user_force has shape", "(2, 2)"): [
        advanced(force=wrong) for wrong in ([1.0, 2.0], 5.0, np.zeros((0, 2, 2)), np.zeros((2, 3, 2, 2)))
    ],
    ("user_force has shape (5, 2, 3)", "(5, 2, 2)"): [advanced(force=np.zeros((5, 2, 3)))],
    ("user_force = [[1, 2], [3]]", "numbers of shape (2, 2)"): [advanced(force=[[1, 2], [3]])],
    ("duration = ", "a positive number, at most 3600 (s)"): [advanced(duration=wrong) for wrong in (NAN, 0, -0.01, "long")],
    ("position = (0.5, 9) m is unreachable", ""): [linear(pose=(0.5, 9.0))],
    ("pose[1] = nan", "finite numbers"): [linear(pose=(0.5, NAN))],
    ("pressures = ", "101300 to 700000 (Pa"): [linear(pressures=(1e5, 2e5, 3e5, 9e5))],
    # 1.33 (11.7 N + 5e-6 N/Pa (8 bar less twice the atmosphere)).
    ("leave 204.1 N on piston 2", "what friction holds, at most 19.53 N"): [linear(pressures=HIGH_BELOW)],
    ("leave 204.1 N on piston 2", ""): [linear(pressures=HIGH_BELOW, friction="sliding")],
    ("openings = ", "-1 to 1"): [linear(openings=(0.0, 0.0, 0.0, 2.0))],
    ("force has shape (1,)", "(2,)"): [linear(force=(1.0,))],
    ("frequency = 0", "above 0"): [lambda: linearize(None, (0.5, 0.0)).frequency_response([1.0, 0.0])],
    ("unknown parameter 'mechanics.weight'", "mass, gravity"): [lambda: RIG.replace({"mechanics.weight": 0.9})],
    ("'mechanics.mas' (did you mean 'mass'?)", "mass, gravity"): [lambda: RIG.replace({"mechanics.mas": 0.9})],
    ("unknown parameter section 'motor'", "geometry, cylinder1"): [lambda: RIG.replace({"motor.mass": 0.9})],
    ("Geometry.k1 = 0.43 with stroke 0.2 is impossible", ""): [lambda: RIG.replace({"geometry.d3": 0.9})],
    ("Geometry.k1 = 0.43 with stroke 0.4", ""): [
        lambda: Parameters.from_dict({"cylinder1": {"stroke": 0.4}, "geometry": {"d3": 0.35}}),
    ],
    ("dead_volume = 1e-05 is impossible", ""): [
        lambda: Parameters.from_dict({"cylinder1": {"piston_diameter": 0.05}, "chambers": {"dead_volume": 1e-5}}),
    ],
    ("cylinder1 = 25", "an instance of Cylinder"): [lambda: Parameters(cylinder1=25)],
    **{
        (f"force_sensor = False with law = '{law}'", ""): [residual(law, force_sensor=False)]
        for law in (*filter(needs_force, LAWS), "admittance", "admittance[learn=false]")
    },
    ("law = 'admittance[gain=60]'", "'backstepping', "): [residual("admittance[gain=60]")],
    ("impedance = 'variable_kp'", "impedance = 'fixed'"): [residual(impedance="variable_kp", force_sensor=False)],
    ("force_sensor = ", ""): [make(force_sensor=wrong) for wrong in (1, None, "no") for make in (residual, env)],
}  # fmt: skip
CASES = [
    pytest.param(call, named, allowed, id=f"{named}-{k}")
    for (named, allowed), calls in TABLE.items()
    for k, call in enumerate(calls)
]


@pytest.mark.parametrize(("call", "named", "allowed"), CASES)
def test_a_refused_call_says_what_is_wrong_and_what_is_allowed(call, named, allowed):
    with pytest.raises((ValueError, TypeError)) as caught:
        call()
    before, said, after = str(caught.value).partition("allowed")
    assert said, caught.value
    assert named in before, caught.value
    assert allowed in after, caught.value
    assert "\n" not in before + after
