"""What a user gives is taken by one rule each, wherever it is given: numbers, counts, flags, paths, arrays, options."""

import os
import warnings
from dataclasses import asdict, fields, replace
from decimal import Decimal
from fractions import Fraction

import gymnasium
import numpy as np
import pytest
import torch

import birthsim_env
from agents.policy.files import read_policy
from agents.policy.seeds import best_policy, policy_folders
from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings, load_configuration
from baselines import evaluate
from baselines.named import known_options, make_controller
from birthsim_env import Measurement, Parameters, Reference
from birthsim_env.parts.hands import contractions, sine, steps, user_forces
from birthsim_env.parts.sensors.ideal import IdealSensors
from birthsim_env.physics.rig.arrays import floats_of
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.physics.rig.values import checked_count, checked_number, whole_of
from birthsim_env.registry import names
from birthsim_env.vector_env import BirthSIMVectorEnv
from tests.registered import registered

CIRCLE = "BirthSIM/Circle-v2"


def shut(measurement, reference):
    return np.zeros((4, measurement.position.shape[1]))


def evaluated(**arguments):
    return evaluate(CIRCLE, shut, "shut", **{"episodes": 2, "seed": 0, "progress": False, "duration": 0.01, **arguments})


def stepped(**arguments):
    env = gymnasium.make_vec(CIRCLE, **{"num_envs": 2, "duration": 0.1, **arguments})
    env.reset(seed=0)
    return env.step(np.zeros((2, 4)))[0]


NUMBERS = {
    "mechanics.mass": (lambda x: Parameters().replace({"mechanics.mass": x}), 4),
    "policy_period": (lambda x: stepped(policy_period=x), 0.1),
    "duration": (lambda x: stepped(duration=x), 1),
    "stiffness": (lambda x: stepped(stiffness=x), 2000),
    "randomize": (lambda x: stepped(randomize={"mechanics.mass": (x, 5.0)}), 4),
    "amplitude": (lambda x: stepped(user_force=sine.Sine(x)), 4),
    "begins": (lambda x: stepped(user_force=user_forces.Ramp(begins=x), duration=4.0), 1),
    "radius": (lambda x: stepped(reference=birthsim_env.Circle(radius=(x, 0.05))), 0.0),
    "times": (
        lambda x: stepped(stiffness=birthsim_env.StiffnessSchedule((0.0, x), (2000.0,) * 2, (4600.0,) * 2, (2300.0,) * 2)),
        1,
    ),
    "bandwidth": (lambda x: make_controller("pid", Parameters(), bandwidth=x), 60),
    "lead_time": (lambda x: make_controller("admittance", Parameters(), lead_time=x), 0.001),
    "damping_ratio": (lambda x: make_controller("backstepping", Parameters(), damping_ratio=x), 1),
    "authority": (lambda x: ResidualSettings(authority=x), 50),
    "learning_rate": (lambda x: TrainingSettings(learning_rate=x), 0.001),
}
COUNTS = {
    "episodes": (lambda n: evaluated(episodes=n).seeds, 2),
    "seed": (lambda n: evaluated(seed=n).seeds, 5),
    "num_envs": (lambda n: BirthSIMVectorEnv("circle", num_envs=n).num_envs, 2),
    "num_threads": (lambda n: stepped(num_threads=n), 2),
    "max_episode_steps": (lambda n: gymnasium.make_vec(CIRCLE, num_envs=2, max_episode_steps=n).steps, 3),
    "picture_size": (lambda n: stepped(picture_size=(n, n)), 640),
    "repeats": (lambda n: stepped(user_force=steps.AlternatingSteps(repeats=n)), 2),
    "count": (lambda n: stepped(user_force=contractions.Contractions(count=n)), 2),
    "reset": (lambda n: gymnasium.make_vec(CIRCLE, num_envs=2).reset(seed=n)[0], 3),
    "reset, a list": (lambda n: gymnasium.make_vec(CIRCLE, num_envs=2).reset(seed=[n, None])[0][0], 3),
    "lanes": (lambda n: TrainingSettings(lanes=n).lanes, 64),
    "hidden": (lambda n: TrainingSettings(hidden=(n,)).hidden, 8),
    "random-valves": (lambda n: make_controller("random-valves", Parameters(), seed=n)._seed, 3),
}
DURATIONS = (np.timedelta64(4, "s"), np.timedelta64(4))
NO_NUMBERS = (True, np.True_, "4", *DURATIONS, Fraction(4), Decimal(4), np.array(4.0), 4 + 0j, None, [4.0], np.nan)


@pytest.mark.parametrize("name", NUMBERS)
def test_numbers_of_numpy_are_numbers_and_nothing_else_is(name):
    use, value = NUMBERS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kinds = (np.float64, np.float32, np.longdouble, *((np.int64, np.uint8) if value == int(value) and value < 256 else ()))
        for kind in kinds:
            use(kind(value))
    for wrong in NO_NUMBERS:
        if not (wrong is None and name in ("duration", "stiffness", "damping_ratio", "learning_rate")):
            with pytest.raises(ValueError, match="allowed: "):
                use(wrong)


@pytest.mark.parametrize("name", COUNTS)
def test_a_count_is_any_whole_number_and_no_flag(name):
    use, value = COUNTS[name]
    expected = use(value)
    for given in (np.int64(value), np.uint16(value), float(value), np.float32(value)):
        assert np.array_equal(use(given), expected)
    for wrong in (True, np.True_, value + 0.5, str(value), Fraction(value), np.array(value), -2):
        # Gymnasium looks at seeds first.
        with pytest.raises((ValueError, gymnasium.error.Error), match=r"allowed: |Seed must be greater or equal to zero"):
            use(wrong)


def test_what_is_kept_is_pythons():
    """NumPy's singles would compute in single precision, and have no JSON."""
    rig = Parameters().replace({"mechanics.mass": np.float32(4.5), "cylinder1.stroke": np.float64(0.2)})
    assert {type(value) for section in rig.to_dict(options=True).values() for value in section.values()} <= {int, float, str}
    assert {type(value) for value in asdict(ResidualSettings(authority=np.float32(50))).values()} <= {int, float, str, bool}
    assert type(checked_number("x", np.float16(1), "s")) is float
    assert type(checked_count("x", np.float32(1), 0, 2)) is int
    assert whole_of(1e300) == int(1e300)
    law = make_controller("admittance", Parameters(), lead_time=np.float32(0.001))
    law.prepare(1, False)
    same = make_controller("admittance", Parameters(), lead_time=float(np.float32(0.001)))
    same.prepare(1, False)
    np.testing.assert_array_equal(law._made[-1].constants, same._made[-1].constants)


def test_a_device_is_a_name():
    for wrong in (["cuda"], {}, np.array("cuda"), 3, "gpu"):
        with pytest.raises(ValueError, match=r"device = .*; allowed: .*cuda"):
            stepped(device=wrong)


@pytest.mark.parametrize("flag", ["force_sensor", "clip_actions", "randomize"])
def test_flags_of_numpy_are_flags(flag):
    np.testing.assert_array_equal(stepped(**{flag: np.True_}), stepped(**{flag: True}))
    with pytest.raises(ValueError, match=rf"{flag} = 1; allowed: .*True"):
        stepped(**{flag: 1})


class Place(os.PathLike):
    """A path that is neither text nor a ``Path``."""

    def __init__(self, path):
        self.path = path

    def __fspath__(self):
        return str(self.path)


@pytest.fixture
def files(tmp_path):
    Parameters().to_toml(Place(tmp_path / "rig.toml"))
    (tmp_path / "course.csv").write_text("time,x,y,stiffness\n" + "".join(f"{t / 10},0.5,0,2000\n" for t in range(30)))
    (tmp_path / "push.csv").write_text("time,Fx,Fy\n0,0,0\n1,5,0\n")
    (tmp_path / "own.py").write_text("def hand(t): return 1.0, 0.0\ndef law(m, r): return [[0.0]] * 4\n")
    return tmp_path


def test_a_path_is_text_or_pathlike(files):
    own = files / "own.py"
    for path in (str, Place):
        stepped(parameters=path(files / "rig.toml"), reference=path(files / "course.csv"), stiffness=path(files / "course.csv"))
        stepped(user_force=path(files / "push.csv"))
        stepped(user_force=path(f"{own}:hand"))
        make_controller(path(f"{own}:law"), path(files / "rig.toml"))
        birthsim_env.Plant(path(files / "rig.toml"))
        assert len(policy_folders(path("circle"))) == 5
        read_policy(path(best_policy(path("circle"))))
        load_configuration(path("circle"))
    for use in (load_parameters, policy_folders, load_configuration, Parameters.from_toml):
        for wrong in (3, True, b"rig.toml", 1.5, ["rig.toml"]):
            with pytest.raises(ValueError, match="allowed: "):
                use(wrong)


def _arrays(shape):
    """What is no array of floats, though NumPy would make one of it, or which it refuses in words of its own."""
    zeros = np.zeros(shape)
    masked = np.ma.array(zeros, mask=False)
    masked[0] = np.ma.masked
    rows = torch.zeros(shape, requires_grad=True)
    return {
        "requires grad": rows, "requires_grad": [row * 1 for row in rows], "complex": zeros + 0j, "masked": masked,
        "text": zeros.astype(str), "True and False": zeros.astype(bool), "dates": zeros.astype("M8[s]"),
        "no number": zeros.astype(int).astype(object) + Fraction(1, 2),
    }  # fmt: skip


class Hand(birthsim_env.UserForce):
    closed_loop = True

    def __init__(self, force):
        self.value = force

    def force(self, time, position, velocity):
        return self.value


class Course(birthsim_env.Trajectory):
    def __init__(self, rows):
        self.rows = rows

    def sample(self, time):
        return self.rows


@pytest.mark.parametrize("kind", _arrays((1,)))
def test_what_would_become_numbers_in_silence_is_refused_with_its_cause(kind):
    single = gymnasium.make(CIRCLE).unwrapped
    single.reset(seed=0)
    several = gymnasium.make_vec(CIRCLE, num_envs=2)
    several.reset(seed=0)
    two, four = _arrays((2,))[kind], _arrays((4,))[kind]
    both = _arrays((4, 2))[kind]
    uses = {
        "action": lambda: single.step(four),
        "action ": lambda: several.step(_arrays((2, 4))[kind]),
        "controller 'law': command": lambda: evaluate(CIRCLE, lambda m, r: both, "law", 2, 0, progress=False, duration=0.01),
        "user_force": lambda: stepped(user_force=lambda t: two),
        "user_force.force": lambda: stepped(user_force=Hand(_arrays((2, 2))[kind])),
        "reference": lambda: stepped(reference=lambda t: two),
        "reference.sample": lambda: stepped(reference=Course(_arrays((8, 2))[kind])),
        "options": lambda: single.reset(options={"position": two}),
        "state": lambda: birthsim_env.Plant().derivatives(_arrays((18, 1))[kind], np.zeros((4, 1)), np.zeros((2, 1))),
    }
    for name, use in uses.items():
        with pytest.raises(ValueError, match=r"allowed: ") as caught:
            use()
        assert name.strip() in str(caught.value)
        if name not in ("options", "reference.sample"):
            assert kind.replace("_", " ").partition(" ")[0] in str(caught.value), name


@pytest.mark.parametrize("kind", _arrays((1,)))
@pytest.mark.parametrize("lanes", [(), (2,)])
def test_a_controller_is_handed_numbers(kind, lanes):
    """Measured by a sensor of a user's own, asked for, or to be believed in."""
    law, shapes = make_controller("admittance", Parameters()), {"time": (), "position_time": (), "pressures": (4,)}
    names = [one.name for one in fields(Measurement) if one.name != "sampled"]
    good = {name: np.full((*shapes.get(name, (2,)), *lanes), 0.5) for name in names}
    wanted = Reference(np.full((15, *lanes), 2000.0))
    odd = {name: _arrays((*shapes.get(name, (2,)), *lanes) or (1,))[kind] for name in names}
    for name in names:
        with pytest.raises(ValueError, match=rf"measurement\.{name} .*; allowed: "):
            law.command(Measurement(**{**good, name: odd[name]}, sampled=False), wanted)
    seen = Measurement(**good, sampled=False)
    with pytest.raises(ValueError, match=r"reference\.rows .*; allowed: "):
        law.command(seen, Reference(_arrays((15, *lanes))[kind]))
    with pytest.raises(ValueError, match=r"feedforward_force .*; allowed: "):
        law.command(seen, wanted, feedforward_force=_arrays((2, *lanes))[kind])


class Sensors(IdealSensors):
    """A user's own, of which one signal is odd."""

    name, odd = "position", None

    def measure(self, *given):
        return replace(super().measure(*given), **{self.name: self.odd})


@pytest.mark.parametrize("kind", _arrays((1,)))
def test_sensors_of_ones_own_tell_numbers(kind, monkeypatch):
    registered(monkeypatch, Sensors, sensors="own")
    for name, shape in (("time", (2,)), ("position", (2, 2)), ("pressures", (4, 2)), ("acceleration", (2, 2))):
        monkeypatch.setattr(Sensors, "name", name)
        monkeypatch.setattr(Sensors, "odd", _arrays(shape)[kind])
        with pytest.raises(ValueError, match=rf"measurement\.{name} = .*; allowed: an array of numbers"):
            stepped(sensors="own")


def test_arrays_of_numbers_are_taken_whatever_made_them():
    for value in (
        torch.ones(3),
        np.ma.array([1, 1, 1]),
        [1, np.float32(1), 1.0],
        np.array([1, 1.0, 1], dtype=object),
        (1,) * 3,
    ):
        np.testing.assert_array_equal(floats_of(value), np.ones(3), strict=True)
    own = np.ones(3)
    assert floats_of(own) is own


@pytest.mark.parametrize("name", [name for name in names("controller") if known_options(name) is not None])
def test_an_option_that_a_controller_has_not_is_refused_with_those_that_it_has(name):
    known = known_options(name)
    for call in (
        lambda: make_controller(name, Parameters(), no_such=3),
        lambda: make_controller(f"{name}[no_such=3]", Parameters()),
    ):
        with pytest.raises(ValueError, match=r"no_such = 3(\.0)? is unknown; allowed for ") as caught:
            call()
        assert all(option in str(caught.value) for option in known)


def test_a_name_that_is_nearly_right_is_asked_about():
    rig = Parameters()
    for call, asked in (
        (lambda: make_controller("pid", rig, bandwith=60), "'bandwidth'"),
        (lambda: rig.replace({"mechanics.mas": 4.0}), "'mass'"),
        (lambda: rig.replace({"mechanic.mass": 4.0}), "'mechanics'"),
    ):
        with pytest.raises(ValueError, match=rf"did you mean {asked}\?"):
            call()
    for call, asked in (
        (lambda: stepped(sensor="lab"), "'sensors'"),
        (lambda: gymnasium.make(CIRCLE, randomise=True), "'randomize'"),
        (lambda: evaluated(sensor="lab"), "'sensors'"),
        (lambda: evaluated(policy_period=0.01), "policy_period"),
    ):
        with pytest.raises(TypeError, match=rf"unexpected keyword argument .*{asked}.*; allowed: "):
            call()
    for wrong in (None, 3, [("mechanics.mass", 4.0)], {3: 4.0}, {"mechanics.mass": {}}):
        with pytest.raises(ValueError, match="allowed"):
            rig.replace(wrong)
