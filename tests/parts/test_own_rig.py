"""A rig of one's own is the one that runs: ranges lie about it, bores and strokes have consequences, the rest is refused."""

import gymnasium
import numpy as np
import pytest

from birthsim_env import Parameters
from birthsim_env.parts.drawn.randomization import described, documented_ranges
from birthsim_env.physics.compiled.lanes import FC1, MASS
from birthsim_env.physics.linkage.geometry import inverse_geometry, jacobian
from birthsim_env.physics.rig.parameters import DECLARED
from birthsim_env.physics.strength import carried
from tests.oracles import rigid_body

HEAVY = """
[mechanics]
mass = 9.0
[cylinder1]
coulomb_friction = 60.0
[cylinder2]
coulomb_friction = 60.0
"""


def drawn(tmp_path, text, lanes=64):
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    env = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=lanes, parameters=tmp_path / "rig.toml", randomize="plant")
    env.reset(seed=0)
    return env.simulation.plant.lane_parameters


def test_drawn_rigs_lie_about_the_one_described_or_where_its_file_says(tmp_path):
    p = drawn(tmp_path, HEAVY)
    assert 7.2 <= p[MASS].min() < 7.5
    assert 10.5 < p[MASS].max() <= 10.8
    assert 48 <= p[FC1].min() < p[FC1].max() <= 72
    own = HEAVY + '[randomize]\n"mechanics.mass" = [8.9, 9.1]\n"air.supply_pressure" = [6e5, 7e5]\n'
    p = drawn(tmp_path, own)
    assert 8.9 <= p[MASS].min() < p[MASS].max() <= 9.1
    rig = Parameters.from_toml(tmp_path / "rig.toml")
    assert documented_ranges(rig)["air.supply_pressure"] == (6e5, 7e5)
    rig.to_toml(tmp_path / "again.toml")
    assert Parameters.from_toml(tmp_path / "again.toml") == rig
    assert rig.replace({"mechanics.mass": 5.0}).ranges == rig.ranges
    assert documented_ranges(Parameters())["mechanics.mass"] == (2, 5)


def test_what_is_drawn_is_said():
    words = described(Parameters().replace({"mechanics.mass": 9.0}), True)
    assert words.startswith("rigs drawn: ")
    assert "mass 7.2 to 10.8 kg" in words
    low, high = DECLARED["cylinder1.coulomb_friction"].range
    assert f"coulomb friction of cylinder1 {low} to {high} N" in words
    assert described(Parameters(), False) == described(Parameters(), "scenario") == "the rig as described"
    assert described(Parameters(), {"mechanics.mass": (2, 3)}) == "rigs drawn: mass 2 to 3 kg"


def test_an_editor_on_windows_may_put_a_mark_before_a_rig(tmp_path):
    (tmp_path / "rig.toml").write_text("[mechanics]\nmass = 4.5\n", encoding="utf-8-sig")
    assert Parameters.from_toml(tmp_path / "rig.toml").mechanics.mass == 4.5


def test_the_dead_volume_follows_the_bore(tmp_path):
    rig = Parameters.from_dict({"cylinder1": {"piston_diameter": 0.05}})
    assert rig.chambers.dead_volume == pytest.approx(4 * Parameters().chambers.dead_volume)
    kept = Parameters.from_dict({"cylinder1": {"piston_diameter": 0.05}, "chambers": {"dead_volume": 3e-5}})
    assert kept.chambers.dead_volume == 3e-5
    assert Parameters.from_dict({"cylinder2": {"stroke": 1.0}}).geometry.k2 == 0.6, "named lengths are kept"
    p = drawn(tmp_path, "[cylinder1]\npiston_diameter = 0.032\n")
    assert np.isfinite(p).all()


@pytest.mark.parametrize("stroke", [0.05, 0.2, 0.29, 0.31, 0.6])
def test_the_linkage_has_room_for_any_stroke_of_cylinder_1(stroke):
    rig, default = Parameters.from_dict({"cylinder1": {"stroke": stroke}}), Parameters().geometry
    scale = rig.geometry.d3 / default.d3
    assert (scale > 1) == (stroke > 0.3)
    assert rig.geometry.d6 / default.d6 == pytest.approx(scale)
    assert rig.geometry.k1 / default.k1 == pytest.approx(scale)
    for y in (-stroke / 2, stroke / 2):
        assert np.isfinite(jacobian(np.array([y, 0.0]), rig)).all()


def test_what_is_carried_is_newtons_law():
    """Virtual work on the linkage of points: the force along a cylinder times its speed is the weight times its rise."""
    rig, place = Parameters(), np.array([[0.45, 0.55], [-0.05, 0.03]])
    spare = rig.air.supply_pressure - rig.air.atmospheric_pressure
    rises = rigid_body.jacobians(inverse_geometry(place, rig), rig)[:, 1].T
    for fraction, force, cylinder in zip(carried(place, rig), 9.81 * 3.0 * rises, (rig.cylinder1, rig.cylinder2), strict=True):
        strength = spare * np.where(force > 0, cylinder.area_p, cylinder.area_n)
        np.testing.assert_allclose(fraction, np.abs(force) / strength, rtol=1e-9)


def test_a_drawn_rig_that_cannot_carry_its_mass_is_part_of_the_experiment():
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=8, randomize={"mechanics.mass": (2.0, 30.0)})
    env.reset(seed=0)
    env.step(np.zeros((8, 4)))
