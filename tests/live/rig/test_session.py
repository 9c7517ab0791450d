"""One rig that a person plays with: the environments' physics, and a state that survives every change."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import gymnasium
import numpy as np
import pytest

import birthsim_env
from baselines.registry import make_controller
from birthsim_build.layout import DRAG_DAMPING, DRAG_LIMIT
from birthsim_env.parts.scenarios import SCENARIOS, environment_id
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.geometry import inverse_geometry
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.frames import SLICES, frame_of
from birthsim_live.rig.hand import Hold
from birthsim_live.rig.session import Session
from birthsim_live.rig.settings import default_settings
from birthsim_live.server.protocol import encode
from tests.live.rig.course import Course

RIG = Parameters()


def session(**settings: Any) -> Session:
    return Session(RIG, default_settings(RIG).model_copy(update=settings))


def part(one: Session, name: str) -> Array:
    return one.row()[SLICES[name]]


@pytest.mark.parametrize(
    ("scenario", "controller", "sensors"),
    [
        ("circle", "backstepping", "ideal"),
        ("circle", "admittance-backstepping", "lab"),
        ("dystocia", "pid", "lab"),
        ("forceps", "backstepping-cartesian", "ideal"),
    ],
)
def test_without_a_person_it_is_the_environment_bit_for_bit(scenario: str, controller: str, sensors: str) -> None:
    one = session(scenario=scenario, controller=controller, sensors=sensors, scenario_force=True)
    env: Any = gymnasium.make_vec(environment_id(scenario), num_envs=1, policy_period=0.001, sensors=sensors)
    env.reset(seed=[0])
    law = make_controller(controller, RIG)
    for _ in range(12):
        for _ in range(100):
            env.step(law.command(env.measurement, env.reference).T)
        one.advance(100)
        assert np.array_equal(one.state, env.simulation.plant.state)


def test_displacement_is_force_over_stiffness_at_once() -> None:
    """The page as it opens: drag, read 2000 N/m; move the slider to 4000, and the displacement halves under one force."""
    one = session()
    one.hands.hold = Hold(np.array([0.53, 0.0]), 7)
    one.advance(1500)
    frame = frame_of(one.row(), RIG)
    assert frame["rendered"][0] == pytest.approx(2000, rel=0.01)
    assert frame["rendered"][1] is None
    assert frame["drag_force"][0] == pytest.approx(20.0, rel=0.01)  # 1000 N/m against 2000 N/m, 30 mm apart
    assert one.hands.used == 7
    one.change({"Kclx": 4000.0})
    one.advance(1500)
    assert part(one, "position")[0] - 0.5 == pytest.approx(0.006, rel=0.01)


CHANGES: list[dict[str, Any]] = [
    {"controller": "backstepping"},
    {"controller": "lqr"},
    {"controller": "residual:circle"},
    {"valves": "one_valve"},
    {"sensors": "lab"},
    {"scenario": "descent"},
    {"scenario": "forceps", "scenario_force": True},
    {"scenario_force": True},
    {"mass": 5.0},
    {"friction": 0.0},
    {"friction": 2.0, "mass": 1.5},
    {"Kclx": 300.0, "Kcly": 8000.0},
    {"Kpneu1": 3000.0, "Kpneu2": 1500.0},
    {"drag_stiffness": 3000.0},
    {"damping": 2.0, "controller": "backstepping-frozen"},
]


@pytest.mark.parametrize("changes", CHANGES, ids=lambda changes: ",".join(changes))
def test_a_change_keeps_state_time_and_motion(changes: dict[str, Any]) -> None:
    one = session(scenario="circle", scenario_force=False)
    one.hands.hold = Hold(np.array([0.56, 0.02]), 1)
    one.advance(700)
    before, row = one.state.copy(), one.row()
    one.change(changes)
    assert np.array_equal(one.state, before)
    now = one.row()
    assert one.time == pytest.approx(0.7)
    for name in ("position", "velocity", "pressures", "drag_force", "pointer"):
        assert np.array_equal(now[SLICES[name]], row[SLICES[name]])
    one.advance(1)
    later = one.row()
    # The target has not jumped: it moves on at the speed that it had, 79 mm/s.
    assert np.linalg.norm(later[SLICES["target"]] - row[SLICES["target"]]) < 1e-4
    assert np.linalg.norm(later[SLICES["position"]] - row[SLICES["position"]]) < 2e-4
    assert np.abs(later[SLICES["scenario_force"]] - row[SLICES["scenario_force"]]).max() < 1.0
    one.advance(400)
    assert one.lost is None


def test_all_controllers_take_over_a_rig_in_motion() -> None:
    one = session(scenario="circle")
    one.advance(300)
    for choice in one.choices.controllers:
        if "missing" in choice or choice["name"] == "nonlinear-mpc":
            continue
        one.change({"controller": choice["name"]})
        one.advance(60)
        assert one.lost is None, choice
        assert one.shown_settings()["controller"] == choice["name"]
    assert one.time == pytest.approx(0.3 + 0.06 * sum(c["name"] != "nonlinear-mpc" for c in one.choices.controllers))


def test_setpoints_pass_over_with_consistent_rates() -> None:
    one = session()
    one.advance(10)
    one.change({"Kpneu1": 3000.0, "Kclx": 4000.0})
    rows = []
    for _ in range(80):
        one.advance(1)
        rows.append(one.lane.reference.rows[:, 0])
    asked = np.array(rows)
    assert asked[0, 8] < 2050
    assert asked[-1, 8:12].tolist() == [4000.0, 2000.0, 3000.0, 2300.0]
    middle = (asked[2:, 10] - asked[:-2, 10]) / 2e-3
    assert np.abs(middle - asked[1:-1, 12]).max() < 0.01 * np.abs(middle).max()
    assert not asked[:, 13].any()
    assert asked[-1, 12] == 0


def test_mass_and_friction_change_the_rig_but_not_what_the_controller_believes() -> None:
    one = session(controller="backstepping-weight")
    one.change({"mass": 5.0, "friction": 0.5})
    plant = birthsim_env.physics.compiled.lanes.parameter_column(
        RIG.replace(
            {
                "mechanics.mass": 5.0,
                "cylinder1.coulomb_friction": 6.0,
                "cylinder2.coulomb_friction": 7.5,
                "cylinder1.viscous_friction": 17.5,
                "cylinder2.viscous_friction": 17.5,
            }
        )
    )
    assert np.array_equal(one.lane.world.rig[:, 0], plant)
    assert one.controller.parameters == RIG  # type: ignore[attr-defined]
    one.reset()
    assert np.array_equal(one.lane.world.rig[:, 0], plant)


def test_the_next_episode_follows_without_a_jump() -> None:
    one = session(scenario="dystocia", scenario_force=True, controller="pid")
    one.duration = 2.0  # the head has drawn back by then
    one.advance(1990)
    rows = []
    for _ in range(40):
        one.advance(1)
        rows.append(one.row())
    table = np.array(rows)
    assert table[-1, SLICES["episode_time"]][0] == pytest.approx(0.03)
    assert np.all(np.diff(table[:, 0]) > 0)
    assert np.abs(np.diff(table[:, SLICES["target"]], axis=0)).max() < 1e-4
    assert np.abs(np.diff(table[:, SLICES["position"]], axis=0)).max() < 1e-4
    # The stiffness falls from 4000 to 2000 N/m within 50 ms instead of at once.
    assert np.abs(np.diff(table[:, SLICES["stiffness"]], axis=0)).max() < 100
    one.advance(1000)
    assert part(one, "target") == pytest.approx([0.5, 0.0], abs=1e-3)


@pytest.mark.parametrize(("first", "second"), list(permutations(SCENARIOS, 2)))
def test_bridges_between_scenarios_stay_in_the_workspace(first: str, second: str) -> None:
    for now in (0.7, 2.9):
        course = Course(SCENARIOS[first].nominal()[0])
        course.follow(SCENARIOS[second].nominal()[0], now)
        samples = np.stack([course.sample(t)[:2] for t in np.arange(now, now + 4, 0.02)], axis=1)
        inverse_geometry(samples, RIG)


@pytest.mark.parametrize(("pointer", "limited"), [([0.53, 0.01], False), ([3.5, 4.0], True)])
def test_the_drag_is_a_saturated_spring_with_a_damper(pointer: list[float], limited: bool) -> None:
    one = session(drag_stiffness=1500.0)
    one.hands.hold = Hold(np.array(pointer), 1)
    one.advance(30)
    position, velocity = part(one, "position"), part(one, "velocity")
    assert np.abs(velocity).max() > 0.01
    pull = 1500.0 * (pointer - position) - DRAG_DAMPING * velocity
    assert part(one, "drag_force") == pytest.approx(pull * DRAG_LIMIT / np.linalg.norm(pull) if limited else pull)


def test_releasing_lets_go() -> None:
    one = session()
    one.hands.hold = Hold(np.array([0.55, 0.0]), 1)
    one.advance(500)
    one.hands.hold = None
    one.advance(1)
    assert not part(one, "drag_force").any()
    assert np.isnan(part(one, "pointer")).all()
    one.advance(1000)
    assert frame_of(one.row(), RIG)["error_mm"] < 0.1


@pytest.mark.parametrize("controller", ["backstepping-frozen", "admittance-backstepping", "pid"])
def test_more_damping_is_a_slower_answer(controller: str) -> None:
    """Without dry friction: how far the hand has come 60 ms after it begins to pull."""
    rig = RIG.replace({"cylinder1.coulomb_friction": 0.0, "cylinder2.coulomb_friction": 0.0})
    ways = []
    for damping in (1.0, 2.0):
        one = Session(rig, default_settings(rig).model_copy(update={"controller": controller, "damping": damping}))
        assert one.shown_settings()["damping_applies"] is True
        one.advance(10)
        one.hands.hold = Hold(np.array([0.53, 0.0]), 1)
        one.advance(60)
        ways.append(part(one, "position")[0] - 0.5)
        one.advance(1500)
        assert frame_of(one.row(), rig)["error_mm"] < 0.3
    assert ways[1] < 0.85 * ways[0]


def test_a_lost_rig_waits_for_reset() -> None:
    one = session()
    one.advance(5)
    one.state[6] = 3e6
    one.advance(50)
    assert one.lost is not None
    assert "pressure of chamber P1" in one.lost
    assert one.halted
    assert one.advance(10) == 0
    time = one.time
    one.change({"Kclx": 3000.0})
    assert one.time == time
    one.reset()
    assert one.lost is None
    assert one.advance(10) == 10
    one.state[0] = np.nan
    one.advance(2)
    assert one.lost is not None
    assert encode(one.frame())  # null where there is no number


def test_a_controller_that_gives_up_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    one = session()

    def command(*_: Any, **__: Any) -> Array:
        raise RuntimeError("no solution")

    monkeypatch.setattr(one.controller, "command", command)
    assert one.advance(5) == 1
    assert one.lost == "admittance-backstepping gives up: no solution"


def test_settings_show_the_setpoints_that_hold() -> None:
    one = session(scenario="circle")
    assert one.shown_settings()["Kpneu1"] == 4600.0
    assert one.shown_settings()["damping_applies"] is True
    one.change({"Kclx": 3000.0})
    shown = one.shown_settings()
    assert (shown["stiffness_source"], shown["Kclx"], shown["Kcly"], shown["Kpneu1"]) == ("sliders", 3000.0, 2000.0, 4600.0)
    one.change({"scenario": "forceps", "controller": "residual:circle"})
    shown = one.shown_settings()
    assert (shown["stiffness_source"], shown["Kclx"], shown["Kpneu1"]) == ("scenario", 4000.0, 4200.0)
    assert shown["damping_applies"] is False


def test_what_is_wrong_changes_nothing() -> None:
    one = session()
    before = one.settings
    for changes, words in (
        ({"Kclx": 3000.0, "mass": 50.0}, "mass = 50.0; allowed: 1.5 to 6 kg"),
        ({"Kclx": 3000.0, "stiffness_source": "scenario"}, "stiffness_source = 'scenario' beside Kclx"),
        ({"controller": "residual:none"}, "controller = 'residual:none'; allowed: backstepping"),
    ):
        with pytest.raises(ValueError, match=words.replace(".", r"\.")):
            one.change(changes)
        assert one.settings == before
