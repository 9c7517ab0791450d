"""What an environment tells: observation and info agree with the docstring, with each other and with the plant."""

import math
import re

import numpy as np
import pytest

from birthsim_env.env import BirthSIMEnv
from birthsim_env.info import FIELDS
from birthsim_env.observation import ENTRIES
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.reward import REWARD_TERMS
from tests.env.test_env_api import IDS, make, random_actions, run
from tests.oracles import linkage_by_points as by_points


def test_the_table_in_the_docstring_is_the_table_of_entries():
    text = BirthSIMEnv.__doc__.split("| index | entry")[1].split("## Reward")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if re.match(r"\s*\| \d", line)]
    assert [int(n) for row in rows[:-1] for n in row[0].split(",")] + [20] == [*range(20), int(rows[-1][0].split()[0])]
    scales = []
    for index, _, scale in rows[:-1]:
        values = [float(v) for v in re.findall(r"[\d.]+(?=[ ,])", scale)] or [1.0]
        entries = [ENTRIES[int(n)] for n in index.split(",")]
        unit = "half strokes" if scale == "half a stroke" else re.sub(r"^[\d., ]+", "", scale)
        assert {entry.unit for entry in entries} == {unit}
        scales += values * (len(entries) // len(values))
    assert scales == [entry.scale for entry in ENTRIES]
    for name, entry in zip(make().observation_names, ENTRIES, strict=False):
        assert name == f"{entry.name}, {entry.scale:g} {entry.unit}"


def along_cylinders(info):
    """The user's force along both cylinders, N, from the work that it does on a small motion of each piston."""
    geometry = Parameters().geometry

    def point(shift1, shift2):
        y1, y2 = info["piston_position"] + (shift1, shift2)
        return by_points.pose_from_lengths(y1 + geometry.k1, y2 + geometry.k2, geometry).end_effector

    h = 1e-6
    motion = [point(h, 0) - point(-h, 0), point(0, h) - point(0, -h)]
    return np.array([way @ info["user_force"] / (2 * h) for way in motion])


@pytest.mark.parametrize("name", IDS)
def test_an_ideal_observation_is_info_over_the_documented_scales(name):
    env = make(name, randomize=True)
    actions = random_actions(120, 4)
    observations, infos = run(env, actions, seed=5)
    for k, (seen, info) in enumerate(zip(observations, infos, strict=True)):
        external = 1.013e5 * math.pi / 4 * 0.010**2
        target = env.simulation.trajectory.sample(np.array([info["time"]]))[:, 0]
        expected = np.concatenate(
            [
                info["tracking_error"] / 0.01,
                info["velocity"] / 0.2,
                info["piston_position"] / (0.1, 0.2),
                (info["pneumatic_force"] - external + along_cylinders(info)) / 200,
                info["pneumatic_stiffness"] / (5000, 2500),
                info["pneumatic_stiffness_setpoint"] / (5000, 2500),
                info["stiffness_setpoint"] / 5000,
                info["user_force"] / 50,
                target[2:4] / 0.2,
                target[4:6] / 0.5,
            ]
        )
        np.testing.assert_allclose(seen[:20], np.clip(expected, -10, 10), rtol=1e-5, atol=1e-5)
        np.testing.assert_array_equal(seen[20:], actions[k - 1] if k else np.zeros(4))


def test_info_has_every_documented_field_and_agrees_with_the_plant():
    env = make("BirthSIM/Forceps-v2", randomize=True)
    _, infos = run(env, random_actions(50, 4, reach=1.0), seed=2)
    for step, info in enumerate(infos):
        assert set(info) == {*FIELDS, *REWARD_TERMS, "is_success"}
        for field, (size, _) in FIELDS.items():
            assert isinstance(info[field], float) if size == 1 else info[field].shape == (size,), field
        assert info["time"] == pytest.approx(0.01 * step, abs=1e-12)
    plant, info = env.simulation.plant, infos[-1]
    motion, flows = plant.end_effector()[:, 0], plant.mass_flows()[:, 0]
    rows = {
        "position": motion[:2], "velocity": motion[2:], "piston_position": plant.piston[:, 0], "opening": plant.state[14:, 0],
        "piston_velocity": plant.piston_speed[:, 0], "pressure": plant.pressures[:, 0],
        "temperature": plant.temperatures[:, 0],
    }  # fmt: skip
    for name, row in rows.items():
        np.testing.assert_array_equal(info[name], row, err_msg=name)
    assert info["supply_flow"] == pytest.approx(np.maximum(flows[:4], 0).sum())
    bore, rod = math.pi / 4 * 0.025**2, math.pi / 4 * 0.010**2
    pp, pn, length = info["pressure"][0::2] * bore, info["pressure"][1::2] * (bore - rod), np.array([0.1, 0.2])
    y = info["piston_position"]
    np.testing.assert_allclose(info["pneumatic_force"], pp - pn)
    np.testing.assert_allclose(info["pneumatic_stiffness"], 1.2 * (pp / (length + y) + pn / (length - y)))
    compliant = info["target"] + info["user_force"] / info["stiffness_setpoint"]
    np.testing.assert_allclose(info["compliant_target"], compliant)
    np.testing.assert_allclose(info["tracking_error"], info["position"] - compliant)
