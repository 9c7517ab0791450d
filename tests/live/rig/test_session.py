"""A rig that a person plays with: what changes while it moves, what it shows, and when it stands still."""

import numpy as np
import pytest

from birthsim_build.layout import LAYOUT
from birthsim_env.physics.compiled.lanes import parameter_array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs.recording import SLICES
from birthsim_live.rig.stages import INSIDE, look_inside
from tests.live.rig.worker import run

CALM = ("set", {"controller": "admittance-backstepping"})
ROW = {row.name: row.number for row in LAYOUT}
RIG = Parameters()

CHANGES = [
    {"controller": "lqr"},
    {"controller": "residual:circle"},
    {"valves": "one_valve"},
    {"sensors": "lab"},
    {"sensors": "honest", "controller": "residual:circle_honest_student"},
    {"scenario": "descent"},
    {"scenario": "forceps", "scenario_force": True},
    {"scenario_force": True},
    {"friction": 2.0, "mass": 1.5},
    {"friction": 0.0},
    {"Kclx": 300.0, "Kcly": 8000.0},
    {"Kpneu1": 3000.0, "Kpneu2": 1500.0},
    {"drag_stiffness": 3000.0},
    {"damping": 2.0, "controller": "backstepping-frozen"},
]


def held(x, y):
    return "hold", {"position": [x, y]}


def one(page, *steps):
    return run(page, [CALM, ("reset", None), *steps])[0][2:]


def test_displacement_is_force_over_stiffness_at_once(page):
    """Drag, read 2000 N/m; move the slider to 4000, and the displacement halves under one force."""
    steps = held(0.53, 0.0), ("advance", 1500), ("set", {"Kclx": 4000}), ("advance", 1500), ("hold", None), ("advance", 1000)
    _, pulled, _, halved, _, released = one(page, *steps)
    assert pulled.frame["rendered"][0] == pytest.approx(2000, rel=0.01)
    assert pulled.frame["rendered"][1] is None
    assert pulled.frame["drag_force"][0] == pytest.approx(20.0, rel=0.01)  # 1000 N/m against 2000 N/m, 30 mm apart
    assert pulled.frame["pointer_id"] == 7
    assert halved.of("position")[0] - 0.5 == pytest.approx(0.006, rel=0.01)
    assert np.isnan(released.of("pointer")).all()
    assert released.frame["error_mm"] < 0.1


def test_a_change_keeps_state_time_and_motion(page):
    begun = [CALM, ("set", {"scenario": "circle"}), ("reset", None), held(0.56, 0.02), ("advance", 700)]
    cases = [[*begun, ("set", changes), ("advance", 1), ("advance", 400)] for changes in CHANGES]
    for changes, told in zip(CHANGES, run(page, *cases), strict=True):
        before, now, later, end = told[-4:]
        state = slice(ROW["y1"], ROW["y1"] + 18)
        assert np.array_equal(now.rows[-1, state], before.rows[-1, state]), changes
        assert now.of("time") == pytest.approx(0.7)
        for name in ("position", "velocity", "pressures", "drag_force", "pointer"):
            assert np.array_equal(now.of(name), before.of(name)), (changes, name)
        # The target has not jumped: it moves on at the speed that it had, 79 mm/s.
        assert np.linalg.norm(later.of("target") - before.of("target")) < 1e-4, changes
        assert np.linalg.norm(later.of("position") - before.of("position")) < 2e-4, changes
        assert np.abs(later.of("scenario_force") - before.of("scenario_force")).max() < 1.0, changes
        assert end.lost is None, (changes, end.lost)
        assert changes.items() <= end.settings.items()


@pytest.mark.slow
def test_the_next_episode_follows_without_a_jump(page):
    world = {"scenario": "dystocia", "scenario_force": True, "controller": "pid"}
    row = run(page, [("set", world), ("reset", None), ("pass", 15900), ("advance", 200)])[0][-1].row
    begins = int(np.flatnonzero(np.diff(row[:, SLICES["episode_time"]][:, 0]) < 0)[0])
    table = row[begins - 20 : begins + 40]
    assert np.all(np.diff(table[:, 0]) > 0)
    assert np.abs(np.diff(table[:, SLICES["target"]], axis=0)).max() < 1e-4
    assert np.abs(np.diff(table[:, SLICES["position"]], axis=0)).max() < 1e-4
    assert np.abs(np.diff(table[:, SLICES["stiffness"]], axis=0)).max() < 100


def test_more_damping_is_a_slower_answer(page):
    """Without dry friction: how far the hand has come 60 ms after it begins to pull."""
    names, factors = ("backstepping-frozen", "admittance-backstepping", "pid"), (1.0, 2.0)
    cases = [
        [("set", {"controller": name, "damping": factor, "friction": 0.0}), ("advance", 10), held(0.53, 0.0), ("advance", 60)]
        for name in names
        for factor in factors
    ]
    found = [told[-1] for told in run(page, *cases)]
    for little, much in zip(found[::2], found[1::2], strict=True):
        assert little.settings["damping_applies"] is True
        assert much.of("position")[0] - 0.5 < 0.85 * (little.of("position")[0] - 0.5)


def test_a_lost_rig_waits_for_reset(page):
    steps = ("advance", 5), ("put", ["Pp1", 3e6]), ("advance", 50), ("advance", 10), ("reset", None), ("advance", 10)
    _, _, lost, still, reset, on = one(page, *steps)
    assert "pressure of chamber P1" in lost.lost
    assert (lost.done, still.done, still.halted) == (1, 0, True)
    assert (reset.lost, on.done) == (None, 10)
    gone = one(page, ("put", ["y1", None]))[-1]
    assert (gone.frame["joints"][0], gone.frame["linkage"]) == (None, None)  # JSON has no NaN
    assert one(page, ("put", ["v1", None]), ("advance", 2))[-1].halted


def test_settings_show_the_setpoints_that_hold(page):
    settings = {"scenario": "circle"}, {"Kclx": 3000.0}, {"scenario": "forceps", "controller": "residual:circle"}
    circle, moved, forceps = run(page, [("set", one) for one in settings])[0]
    assert (circle.settings["Kpneu1"], circle.settings["damping_applies"]) == (4600.0, True)
    names = ("stiffness_source", "Kclx", "Kcly", "Kpneu1")
    assert [moved.settings[name] for name in names] == ["sliders", 3000.0, 2000.0, 4600.0]
    assert [forceps.settings[name] for name in names] == ["scenario", 4000.0, 4000.0, 4200.0]
    assert forceps.settings["damping_applies"] is False


def test_what_is_compared_starts_anew_and_all_else_goes_on(page):
    others = [{"friction": 0.5}, {"scenario": "descent"}, {"scenario_force": True}, {"sensors": "lab"}]
    steps = [step for changes in others for step in (("set", changes), ("advance", 20))]
    beside = [("set", {"compare": name}) for name in ("pid", "lqr", "nothing")]
    told = run(page, [beside[0], ("advance", 50), *steps, *beside[1:]])[0]
    for k in range(2, 2 + 2 * len(others), 2):
        assert told[k].of("time") == told[k - 1].of("time")
        assert np.array_equal(told[k + 1].second_row[-1, SLICES["target"]], told[k + 1].of("target"))
    assert (told[-2].of("time"), told[-2].second_row[-1, 0]) == (0.0, 0.0)
    assert told[-1].frame["second"] is None


def test_one_hand_pulls_both_and_both_stand_still_where_one_is_lost(page):
    _, _, pulled, _, pushed, _, lost, still = run(
        page,
        [
            ("set", {"compare": "admittance-backstepping"}),
            held(0.54, 0.0),
            ("advance", 800),
            ("hold", {"force": [20.0, 0.0]}),
            ("advance", 10),
            ("put", ["Pp1", 3e6, True]),
            ("advance", 5),
            ("advance", 5),
        ],
    )[0]
    drag, pointer = SLICES["drag_force"], SLICES["pointer"]
    assert np.array_equal(pulled.of("pointer"), pulled.second_row[-1, pointer])
    assert pulled.of("drag_force")[0] > pulled.second_row[-1, drag][0] + 1  # dry friction keeps the first head back
    for row in (pushed.row[-1], pushed.second_row[-1]):
        assert row[drag].tolist() == [20.0, 0.0]
        assert row[pointer] == pytest.approx(row[SLICES["position"]] + [0.02, 0.0])
    assert lost.lost is None
    assert "pressure of chamber P1" in lost.frame["second"]["lost"]
    assert (still.done, still.halted) == (0, True)


def test_a_row_holds_friction_and_flows(page):
    told, rows = one(page, held(0.56, 0.02), ("advance", 300))[-1], np.empty((INSIDE, 1))
    look_inside(told.rows[-1, ROW["y1"] : ROW["y1"] + 18, None].copy(), parameter_array(RIG, 1), rows)
    assert np.array_equal(told.of("friction"), rows[:2, 0])
    assert np.array_equal(told.of("flows"), rows[2:, 0])


@pytest.mark.slow
def test_on_the_heavy_rig_of_the_lesson_the_policy_takes_three_quarters_of_the_error(page):
    lesson = {"scenario": "circle", "scenario_force": True, "mass": 4.0, "friction": 1.5}
    cases = [[("set", {**lesson, "controller": name}), ("advance", 8000)] for name in ("backstepping", "residual:circle")]
    rows = [told[-1].row for told in run(page, *cases)]
    law, policy = (np.sqrt(np.mean((row[:, SLICES["position"]] - row[:, SLICES["compliant"]]) ** 2)) for row in rows)
    assert 3.0 < law / policy < 5.0
