"""Times of a user's that miss the episode: refused where nothing falls into it, warned of where little does, silent else."""

import warnings

import gymnasium
import numpy as np
import pytest

from baselines.identification.experiment import propose, read_plan
from birthsim_env import ForceProfile, Parameters, Path, StiffnessSchedule
from birthsim_env.parts.hands.contractions import Contractions
from birthsim_env.parts.hands.pulls import Pulls
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.parts.hands.vacuum import VacuumPulls
from birthsim_env.parts.points import Through

CIRCLE, LASTS = "BirthSIM/Circle-v2", 16.0
TIMES = np.linspace(0.0, LASTS, 161)
X = 0.5 + 0.01 * np.sin(TIMES)
TABLES = {
    "reference": ("time,x,y", np.column_stack([X, 0 * X])),
    "user_force": ("time,Fx,Fy", np.column_stack([500 * (X - 0.5), 0 * X])),
    "stiffness": ("time,stiffness", 2000 + 1000 * np.floor(TIMES)[:, None] % 3000),
}


def made(name, times, folder, **arguments):
    """What making an environment with a file of these times says: the refusal, or its warnings."""
    head, values = TABLES[name]
    path = folder / "own.csv"
    np.savetxt(path, np.column_stack([times, values[: len(times)]]), "%.17g", ",", header=head, comments="")
    return tried(**{name: str(path)}, **arguments)


def tried(**arguments):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            gymnasium.make(CIRCLE, **arguments).reset(seed=0)
        except ValueError as error:
            return "refused", str(error)
    return ("warned" if caught else "silent"), " ".join(str(one.message) for one in caught)


FILES = {
    "in order": (TIMES, {}, "silent", ()),
    "longer than a short episode": (TIMES, {"duration": 0.1}, "silent", ()),
    "longer by far, at a usual rate": (0.01 * TIMES, {"duration": 0.001}, "silent", ()),
    "shorter": (0.5 * TIMES, {}, "silent", ()),
    "late, within the first half": (7.9 + TIMES, {}, "silent", ()),
    "s since 1970": (1.7e9 + TIMES, {}, "refused", ("s since 1970",)),
    "ms since 1970": (1.7e12 + 1e3 * TIMES, {}, "refused", ("ms since 1970",)),
    "us since 1970": (1.7e15 + 1e6 * TIMES, {}, "refused", ("us since 1970",)),
    "ns since 1970": (1.7e18 + 1e9 * TIMES, {}, "refused", ("ns since 1970",)),
    "from 100 s": (100 + TIMES, {}, "refused", ("100 to 116 s", "subtract the first")),
    "from the end": (LASTS + TIMES, {}, "refused", ("16 to 32 s",)),
    "before": (TIMES - 50, {}, "refused", ("-50 to -34 s",)),
    "ms": (1e3 * TIMES, {}, "warned", ("0.1 %", "looks like ms")),
    "ms of a short motion": (100 * TIMES, {}, "warned", ("1 %", "looks like ms")),
    "us": (1e6 * TIMES, {}, "warned", ("0.0001 %", "looks like us")),
    "ns": (1e9 * TIMES, {}, "warned", ("looks like ns",)),
    "ms from 1": (1 + 1e3 * TIMES, {}, "warned", ("looks like ms",)),
    "late": (10 + TIMES, {}, "warned", ("10 s", "62.5 % of the episode")),
    "in part before": (TIMES - 4, {}, "warned", ("40 of 161 rows (24.8 %)",)),
}
MS_OF_A_SCHEDULE = {"ms", "ms of a short motion", "us", "ns"}


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize(("times", "arguments", "outcome", "words"), FILES.values(), ids=FILES)
def test_a_file_falls_into_the_episode_or_one_learns_of_it(name, times, arguments, outcome, words, tmp_path):
    found, said = made(name, times, tmp_path, **arguments)
    assert found == outcome, said
    assert all(word in said for word in words if not (name == "stiffness" and "%" in word)), said
    if found != "silent":
        assert f"{name} = " in said
        assert "own.csv" in said
        assert "0 to " in said, "the episode"
    if found == "refused":
        assert "allowed: seconds since the episode begins" in said


def test_minutes_are_told_from_a_short_motion(tmp_path):
    found, said = made("user_force", TIMES / 60, tmp_path)
    assert (found, "looks like min" in said, "1.7 % of the episode" in said) == ("warned", True, True), said
    assert made("user_force", TIMES[:19] / 60, tmp_path)[0] == "silent", "a few rows by hand may be a short push"


class Late(ForceProfile):
    """A user's own hand, with times of a log."""

    def knots(self, rng):
        return [(1.7e9, 0.0, 0.0), (1.7e9 + 1.0, 10.0, 0.0)]


class Sometimes(ForceProfile):
    """Pushes when it pleases, now and then after the episode."""

    def knots(self, rng):
        return [(0.0, 0.0, 0.0), (rng.uniform(10.0, 90.0) + 10.0, 10.0, 0.0)]


class Bare(ForceProfile):
    """A user's own hand that uses nothing of what it derives from, and calls something else ``timed``."""

    timed = "never"

    def __init__(self):
        pass

    def prepare(self, num_envs):
        pass

    def begin(self, lane, rng):
        pass

    def force(self, time, position, velocity):
        return np.zeros((len(time), 2, time.shape[1]))


TWO, THREE = (2000.0, 3000.0), (2000.0, 3000.0, 2500.0)
OBJECTS = {
    "knots": ({"user_force": ForceProfile([(100, 0, 0), (101, 5, 0)])}, "refused", "100 to 101 s"),
    "a late knot": ({"user_force": ForceProfile([(100, 5, 0)])}, "refused", "100 s"),
    "knots in ms": ({"user_force": ForceProfile([(0, 0, 0), (1000, 30, 0), (2000, 0, 0)])}, "warned", "looks like ms"),
    "knots that change late": ({"user_force": ForceProfile([(0, 0, 0), (100, 0, 0), (101, 5, 0)])}, "warned", "100 s"),
    "constant": ({"user_force": ForceProfile([(0, 5, 0)])}, "silent", ""),
    "a knot": ({"user_force": ForceProfile([(3, 5, 0)])}, "silent", ""),
    "longer": ({"user_force": ForceProfile([(0, 0, 0), (20, 5, 0)]), "duration": 1.0}, "silent", ""),
    "ramp": ({"user_force": Ramp(begins=100.0)}, "refused", "user_force begins at 100 s"),
    "ramp in ms": ({"user_force": Ramp(begins=3000.0)}, "refused", "looks like ms"),
    "pulls": ({"user_force": Pulls((10.0,), 50.0, begins=100.0)}, "refused", "user_force begins at 100 s"),
    "own": ({"user_force": Late()}, "refused", "user_force begins at 1700000000 s"),
    "bare": ({"user_force": Bare()}, "silent", ""),
    "sometimes": ({"user_force": Sometimes()}, "silent", ""),
    "vacuum": ({"user_force": VacuumPulls((0.1,), 50.0)}, "silent", ""),
    "contractions": ({"user_force": Contractions(), "duration": 1.0}, "silent", ""),
    "steps": ({"user_force": "steps", "duration": 0.5}, "silent", ""),
    "late in a short episode": (
        {"user_force": ForceProfile([(0, 0, 0), (8, 0, 0), (9, 5, 0)]), "duration": 4.0}, "silent", ""
    ),
    "scenario": ({"duration": 0.5}, "silent", ""),
    "path": ({"reference": Path(length=0.01, begins=100.0, ends=101.0)}, "refused", "reference begins at 100 s"),
    "points": ({"reference": Through([100, 101], [[0.5, 0], [0.51, 0]])}, "refused", "100 to 101 s"),
    "phases": ({"stiffness": StiffnessSchedule((0.0, 100.0), TWO, (4600.0,) * 2, (2300.0,) * 2)}, "warned", "100 s"),
    "phases in ms": (
        {"stiffness": StiffnessSchedule((0.0, 4000.0, 8000.0), THREE, (4600.0,) * 3, (2300.0,) * 3)}, "warned", "looks like ms"
    ),
}  # fmt: skip


@pytest.mark.parametrize(("arguments", "outcome", "words"), OBJECTS.values(), ids=OBJECTS)
def test_an_object_falls_into_the_episode_or_one_learns_of_it(arguments, outcome, words):
    found, said = tried(**arguments)
    assert found == outcome, said
    assert words in said
    assert found != "refused" or "; allowed: " in said


def test_a_stiffness_from_before_the_episode_is_the_last_one(tmp_path):
    (tmp_path / "own.csv").write_text("time,stiffness\n-2,2000\n-1,3000\n4,4000\n", encoding="utf-8")
    with pytest.warns(UserWarning, match="2 of 3 rows"):
        env = gymnasium.make(CIRCLE, stiffness=str(tmp_path / "own.csv")).unwrapped
    env.reset(seed=0)
    asked = [env.simulation.reference_at(np.array([t])).stiffness[0, 0] for t in (0.0, 3.9, 4.1)]
    np.testing.assert_array_equal(asked, [3000.0, 3000.0, 4000.0])


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [(0.0, 1e3, ("lasts 1.2e+04 s", "looks like ms", "4 to 600 s")), (1.7e9, 1.0, ("1700000000", "s since 1970", "600 s"))],
)
def test_a_plan_in_another_unit_names_it(first, second, words, tmp_path):
    plan = propose(Parameters(), 12.0)
    rows = np.vstack([first + second * plan.times, plan.target, plan.added]).T
    head = "time,x,y,added_P1,added_N1,added_P2,added_N2"
    np.savetxt(tmp_path / "plan.csv", rows, "%.17g", ",", header=head, comments="")
    with pytest.raises(ValueError, match="plan = ") as caught:
        read_plan(tmp_path / "plan.csv", Parameters())
    assert all(word in str(caught.value) for word in words), caught.value
