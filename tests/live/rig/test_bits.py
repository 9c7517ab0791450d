"""The rig of the page computes the bits of the environments: every row of every control period."""

import math

import numpy as np
import pytest

from birthsim_build.layout import DRAG_DAMPING, DRAG_LIMIT
from birthsim_env import Parameters, StiffnessSchedule, UserForce
from birthsim_env.loop.rows import AT_VALVE, SINCE_JUMP
from birthsim_env.parts.scenarios import find_scenario, scenarios_for
from birthsim_env.registry import names
from birthsim_live.rig.folder import packed_page, write_page
from birthsim_live.rig.words import LEARNING
from lab.studies.targets.reference import SHARED, loop_rows
from tests.build.targets import assert_same_bits
from tests.live.rig.worker import run

PERIODS = 400
ROWS = [row for row in SHARED if row != SINCE_JUMP]
"""The page has no use for the time since a jump."""
TUBELESS = [row for row in ROWS if not AT_VALVE <= row < AT_VALVE + 4]
"""The page computes tubes whether or not there are any; what it has at the ends of none counts for nothing."""
PULL, FAR, PUSH, HARD = {"position": [0.56, 0.02]}, {"position": [0.7, -0.2]}, {"force": [20, -5]}, {"force": [90, 90]}
OFFERED = [
    one["name"]
    for one in packed_page(Parameters()).content["hello"]["choices"]["controller"]
    if "missing" not in one and not one["name"].startswith(("limited", LEARNING))
]
DEFAULT, WORN = (
    Parameters(),
    Parameters().replace({"valves.supply_overlap": 0.02, "valves.hysteresis": 0.01, "mechanics.mass": 2.7}),
)
SOFT = Parameters().replace({"chambers.tube_length": 1.0, "air.supply_conductance": 2e-8, "mechanics.mode_frequency": 30.0})
ANOTHER = {
    "scenario": "circle", "scenario_force": True, "mass": 4.3, "friction": 1.37, "Kclx": 3150.0, "valves": "one_valve",
}  # fmt: skip
"""Settings of another rig, other setpoints, and one valve per cylinder."""
RAIL = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": 0.5, "mechanics.mass": 2.0})
FEW = {"backstepping", "admittance-backstepping", "residual:circle", "lqr"}


class Hand(UserForce):
    """The scenario's hand where it pushes, and a person's, from the first control period on."""

    closed_loop = True

    def __init__(self, scenario, rig, pushes, position=None, force=(0.0, 0.0)):
        self.own, self._pushes, self._place, self._push = (
            find_scenario(scenario).on(rig).nominal()[1],
            pushes,
            position,
            np.array(force),
        )
        self.jump_rate = self.own.jump_rate

    def prepare(self, num_envs):
        self.own.prepare(num_envs)

    def begin(self, lane, rng):
        self.own.begin(lane, rng)

    def force(self, time, position, velocity):
        forces = self.own.force(time, position, velocity) * self._pushes
        if time[0, 0] > 0:
            pull = self._push.copy()
            if self._place:
                pull += 1000.0 * (np.array(self._place) - position[:, 0]) - DRAG_DAMPING * velocity[:, 0]
            size = math.sqrt(pull[0] * pull[0] + pull[1] * pull[1])
            forces[0, :, 0] += pull * (DRAG_LIMIT / size) if size > DRAG_LIMIT else pull
        return forces


def expected(controller, settings, hold, rig):
    scenario, friction = settings.get("scenario", "probe"), settings.get("friction", 1.0)
    changes = {"mechanics.mass": settings.get("mass", rig.mechanics.mass)}
    for name, cylinder in (("cylinder1", rig.cylinder1), ("cylinder2", rig.cylinder2)):
        for own in ("coulomb_friction", "pressure_friction", "viscous_friction"):
            changes[f"{name}.{own}"] = getattr(cylinder, own) * friction
    world = {"rig": rig, "parameters": rig.replace(changes), "valves": settings.get("valves", "two_valves")}
    world["user_force"] = Hand(scenario, rig, settings.get("scenario_force", False), **hold)
    if "Kclx" in settings:
        world["stiffness"] = StiffnessSchedule(closed_loop=(settings["Kclx"],), closed_loop_y=(2000.0,))
    return loop_rows(scenario, settings.get("sensors", "ideal"), controller, PERIODS, **world)


def check(page, *cases, rig=DEFAULT):
    cases = [({"controller": "admittance-backstepping", **settings}, hold) for settings, hold in cases]
    steps = [[("set", settings), ("reset", None), ("hold", hold), ("advance", PERIODS)] for settings, hold in cases]
    for (settings, hold), told in zip(cases, run(page, *steps), strict=True):
        rows = ROWS if rig.chambers.tube_length else TUBELESS
        assert_same_bits(told[-1].rows[:, rows], expected(settings["controller"], settings, hold or {}, rig)[:, rows])
        if "compare" in settings:
            other = expected(settings["compare"], settings, hold or {}, rig)
            assert_same_bits(told[-1].second_rows[:, rows], other[:, rows])


def on_the_circle(name, sensors):
    return {"scenario": "circle", "controller": name, "sensors": sensors, "scenario_force": True}


def test_a_law_a_policy_hands_and_another_rig(page):
    check(
        page,
        (on_the_circle("backstepping", "lab"), None),
        (on_the_circle("residual:circle", "ideal"), None),
        ({"controller": "backstepping", "compare": "admittance-backstepping"}, PULL),
        (ANOTHER, HARD),
    )


@pytest.mark.slow
def test_every_scenario_with_every_sensor(page):
    check(
        page,
        *(
            ({"scenario": one, "sensors": kind, "scenario_force": True}, None)
            for one in scenarios_for(DEFAULT)
            for kind in names("sensors")
        ),
    )


@pytest.mark.slow
@pytest.mark.parametrize("sensors", [pytest.param("ideal", marks=pytest.mark.weekly), "lab"])
def test_every_controller(page, sensors):
    assert set(OFFERED) >= FEW
    check(page, *((on_the_circle(name, sensors), None) for name in OFFERED))


@pytest.mark.slow
def test_every_hand(page):
    check(page, *(({**ANOTHER, "valves": "two_valves"}, one) for one in (None, PULL, FAR, PUSH, HARD)))


PAIRS = [("backstepping", "admittance-backstepping"), ("residual:circle", "backstepping"), ("pid", "residual:circle_lab")]


@pytest.mark.slow
@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_both_rigs_are_what_each_would_be_alone(page, one, other):
    check(page, ({**on_the_circle(one, "lab"), "compare": other, "mass": 4.0}, PULL))


@pytest.mark.slow
@pytest.mark.parametrize("rig", [WORN, SOFT], ids=["worn valves", "tubes, a weak supply and a soft structure"])
def test_a_rig_of_ones_own(tmp_path, rig):
    write_page(tmp_path / "page", packed_page(rig))
    check(tmp_path / "page", (on_the_circle("admittance-backstepping", "lab"), PULL), rig=rig)


@pytest.mark.slow
def test_a_rail_whose_guide_bears_what_pulls_across_it(tmp_path):
    write_page(tmp_path / "page", packed_page(RAIL))
    cases = zip(scenarios_for(RAIL), ("ideal", "lab", "encoders"), (PULL, HARD, None), strict=True)
    told = [({"scenario": one, "sensors": kind, "scenario_force": True, "mass": 4.0}, hold) for one, kind, hold in cases]
    check(
        tmp_path / "page", *told, ({"scenario": "rail", "controller": "abry-one-valve", "valves": "one_valve"}, PULL), rig=RAIL
    )
