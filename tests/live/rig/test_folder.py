"""A policy of one's own, another rig, and a rig that the page cannot show: ``birthsim live``."""

import shutil

import numpy as np

from agents import ResidualController, load_policy
from agents.policy.seeds import best_policy
from agents.policy.shipped import SHIPPED
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.folder import packed_page, write_page
from birthsim_live.rig.pack import controller_parts
from tests.live.rig.worker import run

RIG = Parameters()


def test_a_page_has_a_policy_of_ones_own_and_another_rig(tmp_path):
    mine = str(shutil.copytree(SHIPPED / "circle" / "seed_0", tmp_path / "run 1" / "seed_0").parent)
    rig = RIG.replace({"mechanics.mass": 2.5, "cylinder1.coulomb_friction": 9.0})
    packed = packed_page(rig, [mine, "forceps"])
    listed = packed.content["hello"]["choices"]["controller"]
    choices = {one["name"]: one for one in listed}
    assert len(choices) == len(listed)
    assert "run 1" in choices[f"residual:{mine}"]["title"]
    numbers = packed.content["parts"]["controllers"]
    copied, other = numbers[f"residual:{mine}"], numbers["residual:forceps"]
    assert copied["exact"]["policy"] == copied["sampled"]["policy"]  # kept once
    assert copied["exact"]["policy"] != other["exact"]["policy"]
    write_page(tmp_path / "page", packed)
    settings = {"controller": f"residual:{mine}", "scenario": "circle"}
    end = run(tmp_path / "page", [("set", settings), ("reset", None), ("advance", 300)])[0][-1]
    assert (end.lost, end.settings["mass"]) == (None, 2.5)
    assert np.isfinite(end.of("position")).all()


def test_on_a_rail_its_policy_drives_and_none_is_learned(tmp_path):
    packed = packed_page(RIG.replace({"linkage.kind": "rail"}))
    listed = {one["name"]: one for one in packed.content["hello"]["choices"]["controller"]}
    assert "learning" not in listed
    assert [name for name in listed if name.startswith("residual:")] == ["residual:rail_apg"]
    write_page(tmp_path / "page", packed)
    settings = {"controller": "residual:rail_apg", "scenario": "rail", "sensors": "ideal"}
    end = run(tmp_path / "page", [("set", settings), ("reset", None), ("advance", 1500)])[0][-1]
    assert end.lost is None
    assert np.abs(end.of("position") - end.of("target")).max() < 0.01


def test_a_policy_that_remembers_has_a_memory_in_the_page():
    name = "circle_honest_student"
    memory = controller_parts(ResidualController(RIG, name))["sampled"]["policy"].stages[-1].memory
    cells = load_policy(best_policy(name)).network.cells
    assert cells > 0
    np.testing.assert_array_equal(memory[:, 0], np.zeros(1 + cells))


def test_a_scenario_that_a_rig_cannot_do_is_no_choice():
    rig = RIG.replace({"cylinder2.stroke": 0.04})
    choices = {one["name"]: one for one in packed_page(rig).content["hello"]["choices"]["scenario"]}
    assert "missing" not in choices["probe"]
    assert choices["circle"]["missing"] == "not with this rig"
    assert "unreachable" in choices["circle"]["about"]


def test_a_controller_with_options_is_compiled_too():
    names = ["pid[bandwidth=30]", "admittance", "limited:pid", "nobody"]
    content = packed_page(RIG, [], names).content
    listed = [one["name"] for one in content["hello"]["choices"]["controller"]]
    assert listed[-2:] == names[:2]  # the others are for Python, or none
    laws = content["parts"]["controllers"]
    assert laws["pid[bandwidth=30]"] != laws["pid"]
    assert laws["admittance"] == laws["admittance-adaptive"]
