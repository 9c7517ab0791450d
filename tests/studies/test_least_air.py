"""The schedule of least air: its model against the equations solved anew, its choice against all others, its bounds."""

import subprocess
import sys
from itertools import product

import numpy as np
import pytest

from baselines.bench.pneumatic_range import pneumatic_range
from birthsim_env import Circle, FixedTarget, Parameters, Path, StiffnessSchedule
from lab.studies.least_air import schedule as module
from lab.studies.least_air.schedule import GRID, least_air, supplied
from tests.console import ROOT, call, strict
from tests.oracles import derived_law

RIG = Parameters()
PUSHES = [(20.0, 0.0), (-20.0, 0.0), (0.0, 20.0), (0.0, -20.0)]
OWN = StiffnessSchedule((0.0, 2.0), (2000.0, 4000.0), (4600.0, 3600.0), (2300.0, 1800.0), (1500.0, 2500.0), (100.0, -100.0))


def course(schedule, times):
    schedule.prepare(1), schedule.begin(0, np.random.default_rng(0))
    return np.concatenate([schedule.sample(np.array([t])) for t in times], axis=1)


def iso(up, down):
    """Through a shut valve."""
    return derived_law.orifice(RIG.valves.leakage_ratio * RIG.valves.sonic_conductance, up, down, RIG)


def chambers(k, y, force, stiffness):
    """Pressures that have this force and this stiffness (9), and volumes."""
    one = (RIG.cylinder1, RIG.cylinder2)[k]
    lengths = np.array([one.stroke / 2 + y, one.stroke / 2 - y])
    return derived_law.pressures_for(force, stiffness, y, one, RIG), 1e-5 + np.array(derived_law.areas(one)) * lengths


@pytest.mark.parametrize("k", [0, 1])
@pytest.mark.parametrize(("y", "force"), [((0.02, 0.02), (35.0, 35.0)), ((0.0, 0.001), (20.0, 25.0))], ids=["rests", "moves"])
def test_the_air_of_a_cylinder_is_what_leaks_or_fills_it(k, y, force):
    (before, small), (after, large) = (chambers(k, y[i], force[i], 3000.0) for i in range(2))
    middle, held = (before + after) / 2, np.array([before * small, after * large]) / (287.05 * 293.15)
    grown = held[1] - held[0]
    expected = sum(max(m + iso(p, 1.013e5) * GRID, iso(7e5, p) * GRID) for m, p in zip(grown, middle, strict=True))
    given, found = supplied(np.array(y), np.array(force), np.full(2, 3000.0), k, RIG)
    np.testing.assert_allclose(given, expected, rtol=1e-9)
    np.testing.assert_allclose(found, held.sum(axis=1), rtol=1e-12)


def test_no_other_choice_takes_less(monkeypatch):
    """All combinations of a coarse grid, each summed over the schedule as the environments sample it."""
    monkeypatch.setattr(module, "LEVELS", 3)
    reference, own = Path((0.45, 0.0), 0.0, 0.08, begins=0.0, ends=3.0), StiffnessSchedule()
    chosen = least_air(reference, own, 3.0, RIG, PUSHES)
    times = GRID * np.arange(301)
    piston, load = module._along(reference, times, RIG)
    for k, setpoints in enumerate((chosen.pneumatic1, chosen.pneumatic2)):
        lower, upper = module._bounds(k, piston, load[k], [(0.0, 0.0), *PUSHES], 3e4, RIG)
        inside = [(times >= t - 1e-9) & (times <= min(t + 1.5, 3.0) + 1e-9) for t in (0.0, 1.0, 2.0)]
        low, high = (np.array([get(bound[one]) for one in inside]) for get, bound in ((np.max, lower), (np.min, upper)))
        levels = np.unique([*np.linspace(low.min(), high.max(), 3), *low])

        def air(choice, k=k):
            made = StiffnessSchedule((0.0, 1.0, 2.0), (2000.0,) * 3, choice, choice)
            given, held = supplied(piston[k], load[k], course(made, times)[2 + k], k, RIG)
            return given.sum() + held[0]

        possible = [c for c in product(levels, repeat=3) if ((low <= c) & (c <= high)).all()]
        assert len(possible) > 3
        assert air(setpoints) == pytest.approx(min(map(air, possible)), rel=1e-9)


def test_every_push_can_be_borne_and_closed_loop_setpoints_stay():
    reference = Circle(radius=0.03)
    made = least_air(reference, OWN, 4.0, RIG, PUSHES)
    times = GRID * np.arange(401)
    rows, own = course(made, times), course(OWN, times)
    np.testing.assert_array_equal(rows[[0, 1, 6]], own[[0, 1, 6]])
    reference.prepare(1), reference.begin(0, None)
    places = np.concatenate([reference.sample(np.array([t]))[:2] for t in times], axis=1)
    for push in PUSHES:
        least, most = pneumatic_range(places, np.repeat(np.array(push)[:, None], 401, axis=1), RIG)
        assert (rows[2:4] >= least).all()
        assert (rows[2:4] <= most).all()


WRONG = [
    ({"pushes": [(400.0, 0.0)]}, r"pushes = .* are more than cylinder 2 bears from 0 s on with reserve = 30000 Pa"),
    *(({name: value}, rf"{name} = {value}") for name, value in (("phase", 0.2), ("duration", 0.0), ("reserve", -1.0))),
    ({"stiffness": StiffnessSchedule((0.0,), ((1000.0, 2000.0),))}, r"closed_loop = .*; allowed: numbers, not ranges"),
    ({"reference": FixedTarget((0.9, 0.0))}, r"unreachable"),
]


@pytest.mark.parametrize(("wrong", "message"), WRONG)
def test_what_cannot_be_is_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        least_air(**{"reference": FixedTarget(), "stiffness": OWN, "duration": 4.0, "rig": RIG, "pushes": PUSHES, **wrong})


@pytest.mark.slow
def test_the_example_of_labour_runs(tmp_path):
    line = [sys.executable, ROOT / "examples" / "labour.py", "labour.csv"]
    assert "admittance-backstepping" in subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=True).stdout


@pytest.mark.slow
def test_the_study_saves_air_on_the_circle(tmp_path, monkeypatch, capsys):
    status, printed, _ = call("air", monkeypatch, capsys, "--episodes", "2", "--scenario", "circle", "--out", tmp_path)
    assert status == 0
    rows = strict(tmp_path / "air.json")["figures"]
    worlds = list(product(("backstepping", "admittance-backstepping"), ("ideal", "lab")))
    assert [(row["controller"], row["sensors"]) for row in rows] == worlds
    for row in rows[::2]:
        assert row["air"][1] < row["air"][0]
        assert row["saved"][1] > 0
        assert row["lost"] == [0, 0]
    assert (tmp_path / "air.md").read_text() in printed
