"""What a hand feels: each study against a spring of known stiffness and against the law on the frictionless rig."""

import math

import numpy as np
import pytest

from baselines.bench.pneumatic_range import pneumatic_range, pneumatic_setpoint
from baselines.bench.probes import POSES, StiffnessResult
from birthsim_env import Parameters, Plant
from birthsim_env.physics.compiled.lanes import PRESSURES, V1, V2
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.linkage.geometry import inverse_geometry, joint_force
from lab.studies.comparison import stiffness as studies
from lab.studies.comparison import stiffness_figures as study_figures
from lab.studies.comparison.stiffness import disturbance_study, ellipse_study, frictionless, polar_study, stiffness_study

RIG = Parameters()
SMOOTH = frictionless(RIG)


@pytest.fixture
def spring(monkeypatch):
    """Puts a spring in the rig's place: ``["stiffness"]`` (2, 2), ``["offset"]`` (2,), ``["lost"]`` lanes; keeps the cases."""
    state = {"stiffness": np.diag([2500.0, 1600.0]), "offset": (0.0, 0.0), "lost": []}

    def answer(probes, controller):
        state["probes"] = probes
        moved = np.linalg.solve(state["stiffness"], probes.force)
        lost = np.isin(np.arange(probes.size), state["lost"])
        expected = probes.reference().compliant_target(probes.force) - probes.position
        offset = np.array(state["offset"])[:, None] + 0 * moved
        return StiffnessResult(np.where(lost, np.nan, moved), expected, np.abs(moved), lost, offset)

    monkeypatch.setattr(studies, "run_stiffness_test", answer)
    return state


def told(work, rig=RIG, **options):
    return work("backstepping-weight", "", rig.to_dict(), **options)


def test_stiffness_study_has_a_row_per_setpoint_and_a_column_per_case(spring):
    spring["lost"] = [3]
    result = told(stiffness_study, setpoints=(1000.0, 2500.0), poses=POSES[:2], forces=(5.0, 40.0))
    errors = result["error_percent"]
    assert (len(errors), len(errors[0])) == (2, 16)
    assert errors[0][3] is None
    assert result["hunting_mm"][0][3] is None
    # Along x the spring has 2500 N/m, along y 1600.
    np.testing.assert_allclose(errors[1], np.tile([0.0, -36.0], 8), atol=1e-9)
    np.testing.assert_allclose(errors[0][4:], np.tile([150.0, 60.0], 6), atol=1e-9)
    np.testing.assert_allclose(np.hypot(*spring["probes"].force), np.tile(np.repeat([5.0, 40.0], 4), 4))
    np.testing.assert_allclose(result["hunting_mm"][1][:4], [2.0, 3.125, 2.0, 3.125])


def test_disturbance_study_counts_the_distance_from_the_compliant_target(spring):
    spring["stiffness"], spring["offset"] = np.diag([2000.0, 2000.0]), (-1e-3, 0.0)
    result = told(disturbance_study, amplitudes=(2.0, 40.0), poses=POSES[:1])
    np.testing.assert_allclose(result["error_mm"], np.full((2, 4), 1.0))
    np.testing.assert_allclose(result["error_percent"], np.repeat([[100.0], [5.0]], 4, axis=1))


def test_polar_study_is_stiffness_along_the_push(spring):
    result = told(polar_study, directions=8, poses=POSES[:3])
    angles = np.array(result["angles"])
    along = 1 / (np.cos(angles) ** 2 / 2500 + np.sin(angles) ** 2 / 1600)
    np.testing.assert_allclose(result["stiffness"], np.repeat(along[:, None], 3, axis=1))


def test_ellipse_study_recovers_any_matrix_and_marks_a_lost_pose(spring):
    spring["stiffness"], spring["lost"] = np.array([[3000.0, 700.0], [500.0, 1500.0]]), [5]
    result = told(ellipse_study, poses=POSES[:3])
    assert result["stiffness"][1] is None
    for k in (0, 2):
        np.testing.assert_allclose(result["stiffness"][k], spring["stiffness"])
    np.testing.assert_array_equal(spring["probes"].stiffness[:, 0], [3000, 1500, 800])


@pytest.mark.parametrize("force", [(0.0, 0.0), (0.0, -40.0), (30.0, 20.0)])
def test_pneumatic_range_ends_where_a_chamber_reaches_atmosphere_or_supply(force):
    position, push = np.array(POSES).T, np.repeat(np.array(force)[:, None], len(POSES), axis=1)
    plant = Plant(SMOOTH, len(POSES))
    piston = inverse_geometry(position, SMOOTH)
    for bound, pressure in zip(pneumatic_range(position, push, SMOOTH), (1.013e5, 7e5), strict=True):
        # Both pressures of a cylinder from its stiffness and from the force that holds weight and hand.
        held = -joint_force(push + np.array([[0.0], [-3 * 9.81]]), piston, SMOOTH)
        state = balanced_state(plant.lane_parameters, piston)
        for k, (cylinder, rows) in enumerate(((SMOOTH.cylinder1, PRESSURES[:2]), (SMOOTH.cylinder2, PRESSURES[2:]))):
            lengths = cylinder.stroke / 2 + piston[k], cylinder.stroke / 2 - piston[k]
            for lane in range(len(POSES)):
                areas = cylinder.area_p, cylinder.area_n
                equations = [[areas[0], -areas[1]], [1.2 * areas[0] / lengths[0][lane], 1.2 * areas[1] / lengths[1][lane]]]
                wanted = [held[k, lane] + 1.013e5 * (areas[0] - areas[1]), bound[k, lane]]
                state[list(rows), lane] = np.linalg.solve(equations, wanted)
        rates = plant.derivatives(state, np.zeros((4, len(POSES))), push)
        np.testing.assert_allclose(rates[[V1, V2]], 0, atol=1e-8)
        extreme = state[list(PRESSURES)].reshape(2, 2, -1)
        at_limit = extreme.min(axis=1) if pressure < 2e5 else extreme.max(axis=1)
        np.testing.assert_allclose(at_limit, pressure, rtol=1e-9)


def test_the_setpoint_lies_inside_both_ranges():
    position, moved, force = np.array([[0.62], [-0.1]]), np.array([[0.0], [-0.01]]), np.array([[0.0], [-40.0]])
    setpoint = pneumatic_setpoint(position, moved, force, RIG)
    for low, high in (pneumatic_range(position, 0 * force, RIG), pneumatic_range(position + moved, force, RIG)):
        assert (low < setpoint).all()
        assert (setpoint < high).all()
    # 4400 N/m, which is within reach at rest, is not under the push.
    low, _ = pneumatic_range(position + moved, force, RIG)
    assert low[0, 0] > 4400
    with pytest.raises(ValueError, match=r"position = \(0.9, 0\) m is unreachable"):
        pneumatic_range(np.array([[0.9], [0.0]]), 0 * force, RIG)


def test_pictures_show_medians_and_ranges_and_name_what_is_lost(drawn, tmp_path):
    good = {"setpoints": [1e3, 4e3], "error_percent": [[1, 2, 9], [3, None, 5]], "hunting_mm": [[1e-9, 2], [4, 3]]}
    bad = {**good, "error_percent": [[None] * 3] * 2, "hunting_mm": [[None] * 2] * 2}
    polar = {"angles": [0, 2, 4], "setpoint": 2000, "stiffness": [[2000, 2200, 1900]] * 2 + [[1500, None, 1500]]}
    ellipse = {"poses": [[0.4, 0], [0.5, 0]], "setpoint": [[2000, 0], [0, 2000]], "stiffness": [[[2200, 0], [0, 2000]], None]}
    push = {"amplitudes": [2, 40], "error_percent": [[100, 300, 200], [5, 7, 6]]}
    figures = {
        "stiffness": {"good": good, "bad": bad},
        "polar": {"good": polar, "bad": {**polar, "stiffness": [[None] * 3] * 3}},
        "ellipses": {"good": ellipse, "bad": {**ellipse, "stiffness": [None, None]}},
        "disturbance": {f"{name}, {rig}": push for name in ("law", "more") for rig in ("with friction", "frictionless")},
    }
    study_figures.draw_studies(figures, tmp_path)
    stiffness = drawn["rendered_stiffness"]
    assert [t.get_text() for t in stiffness.legends[0].get_texts()] == ["1000 N/m", "4000 N/m"]
    assert [t.get_text() for t in stiffness.axes[0].get_yticklabels()] == ["good (1 of 6 lost)", "bad (6 of 6 lost)"]
    np.testing.assert_allclose([line.get_xdata()[0] for line in stiffness.axes[0].lines[:2]], [2.0, 4.0])
    ranges = [line[:, 0] for one in stiffness.axes[0].collections[:2] for line in one.get_segments()]
    np.testing.assert_allclose(ranges, [[1.0, 9.0], [3.0, 5.0]])
    labels = [t.get_text() for t in drawn["hunting"].axes[0].get_yticklabels()]
    assert labels == ["good", "bad (4 of 4 lost)"]
    first, second = drawn["stiffness_by_direction"].axes[:2]
    assert first.get_title() == "good\n1950, 1500 to 2200 N/m; 1 of 9 lost"
    assert second.get_title() == "bad\nall lost"
    np.testing.assert_allclose(first.lines[0].get_ydata(), [2000, 2000, 1500, 2000])
    first, second = drawn["stiffness_ellipses"].axes[:2]
    assert first.get_title() == f"good\noff by {100 * 200 / math.hypot(2000, 2000):.3g} %; 7.07 %"
    assert second.get_title() == "bad\nall lost"
    rendered = first.lines[0]
    assert (rendered.get_xdata().max() - 400) / (rendered.get_ydata().max()) == pytest.approx(1.1, rel=1e-3)
    left, right = drawn["disturbances"].axes
    assert (left.get_title("left"), right.get_title("left")) == ("Frictionless", "With friction")
    np.testing.assert_allclose(left.lines[0].get_ydata(), [200, 6])
