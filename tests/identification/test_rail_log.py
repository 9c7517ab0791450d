"""The log of one cylinder: read in any of its forms, refused by what it lacks, and the rig that made it found."""

import math
import warnings

import numpy as np
import pytest

import birthsim
from baselines.figures.identification import residuals_figure
from baselines.identification.experiment import propose, read_plan
from baselines.identification.fit.free_parameters import free_of
from baselines.identification.laboratory import run_plan
from baselines.identification.log.log_columns import LogOptions
from baselines.identification.log.log_file import read_trial, write_trial
from birthsim_env.physics.rig.parameters import Parameters

KNOWN = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": math.radians(30.0)})
TRUE = KNOWN.replace({"mechanics.mass": 3.6, "cylinder2.coulomb_friction": 15.0, "chambers.dead_volume": 14e-6})


@pytest.fixture(scope="module")
def trial():
    plan = propose(KNOWN, duration=4.0)
    return run_plan(plan, [TRUE], birthsim.make_controller("backstepping", KNOWN), "encoders", 0)[0]


@pytest.fixture
def columns(trial, tmp_path):
    write_trial(trial, tmp_path / "log.csv", KNOWN)
    names, *rows = (tmp_path / "log.csv").read_text().splitlines()
    return dict(zip(names.split(","), np.array([[float(cell) for cell in row.split(",")] for row in rows]).T, strict=True))


def written(columns, place):
    rows = zip(*columns.values(), strict=True)
    place.write_text("\n".join([",".join(columns), *(",".join(f"{cell:.10g}" for cell in row) for row in rows)]) + "\n")
    return place


def test_a_log_has_one_cylinder_and_comes_back(trial, columns, tmp_path):
    assert list(columns) == ["time", "openings_P", "openings_N", "pressures_P", "pressures_N", "position", "force"]
    assert np.ptp(columns["position"]) > 0.05
    found = read_trial(written(columns, tmp_path / "again.csv"), KNOWN)
    np.testing.assert_allclose(found.openings, np.clip(trial.openings, -1, 1), atol=1e-9)
    np.testing.assert_allclose(found.pressures[2:], trial.pressures[2:], rtol=1e-9)
    np.testing.assert_allclose(found.positions, trial.positions, atol=1e-9)
    assert np.isnan(found.pressures[:2]).all()


def test_one_valve_is_taken_both_ways_round(columns, tmp_path):
    one = {name: values for name, values in columns.items() if not name.startswith("openings")}
    one["opening"] = 0.3 * np.sin(40.0 * columns["time"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = read_trial(written(one, tmp_path / "one.csv"), KNOWN)
    np.testing.assert_array_equal(found.openings[2], -found.openings[3])
    np.testing.assert_allclose(found.openings[2], one["opening"], atol=1e-9)
    assert not found.openings[:2].any()


def test_a_bench_in_volts_is_read_by_factor_and_offset(columns, tmp_path):
    """Of a valve with 5 V where it is shut and 10 V where it is open, gauge cells of 1 V/bar, and a potentiometer of 20 V/m."""
    one = {"time": columns["time"], "u [V]": 5.0 + 5.0 * 0.3 * np.sin(40.0 * columns["time"])}
    one |= {f"p_{side} [V]": (columns[f"pressures_{side}"] - 101325.0) / 1e5 for side in "PN"}
    one["x [V]"] = 20.0 * (columns["position"] + 0.25)
    path = written(one, tmp_path / "volts.csv")
    said = "opening=u*0.2-1,pressures_P=p_P*1e5+101325,pressures_N=p_N * 1e5 + 101325,position=x*0.05-0.25"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = read_trial(path, KNOWN, LogOptions(said))
    np.testing.assert_allclose(found.openings[2], 0.3 * np.sin(40.0 * columns["time"]), atol=1e-9)
    np.testing.assert_allclose(found.openings[3], -found.openings[2], atol=0)
    np.testing.assert_allclose(found.pressures[2:], [columns["pressures_P"], columns["pressures_N"]], rtol=1e-8)
    along = np.hypot(*found.positions) - KNOWN.geometry.k2
    np.testing.assert_allclose(along, columns["position"], atol=1e-9)


def test_volts_without_factor_are_refused_with_the_way_out(columns, tmp_path):
    one = {name: values for name, values in columns.items() if not name.startswith("openings")}
    path = written(one | {"opening [V]": 5.0 + np.sin(40.0 * columns["time"])}, tmp_path / "volts.csv")
    with pytest.raises(ValueError, match=r"opening=opening\*FACTOR\+OFFSET"):
        read_trial(path, KNOWN)


@pytest.mark.parametrize("said", ["opening=u*0", "opening=u*1e999", "opening=u*1-1e999"])
def test_a_factor_that_loses_the_column_is_refused(columns, said, tmp_path):
    path = written(columns | {"u": columns["openings_P"]}, tmp_path / "log.csv")
    with pytest.raises(ValueError, match=r"--columns .*allowed: finite"):
        read_trial(path, KNOWN, LogOptions(said))


def test_a_log_without_force_says_so(columns, tmp_path):
    del columns["force"]
    with pytest.warns(UserWarning, match="no force"):
        assert not read_trial(written(columns, tmp_path / "free.csv"), KNOWN).forces.any()


@pytest.mark.parametrize("lacking", ["position", "openings_N", "pressures_P"])
def test_what_is_lacking_is_named_with_what_one_cylinder_needs(columns, lacking, tmp_path):
    del columns[lacking]
    with pytest.raises(ValueError, match=lacking) as refused:
        read_trial(written(columns, tmp_path / "less.csv"), KNOWN)
    assert all(name in str(refused.value) for name in ("position", "opening", "pressures_P", "5/3"))


@pytest.mark.parametrize(("factor", "more", "named"), [(1.0, 0.25, "mid stroke"), (1e3, 0.0, "mm")])
def test_positions_from_another_zero_or_unit_are_refused(columns, factor, more, named, tmp_path):
    columns["position"] = factor * (columns["position"] + more)
    with pytest.raises(ValueError, match="position") as refused:
        read_trial(written(columns, tmp_path / "off.csv"), KNOWN)
    assert named in str(refused.value)


def test_exchanged_columns_are_named_as_the_log_names_them(columns, tmp_path):
    columns["pressures_P"], columns["pressures_N"] = columns["pressures_N"], columns["pressures_P"]
    with pytest.raises(ValueError, match="pressures_P follows openings_N"):
        read_trial(written(columns, tmp_path / "exchanged.csv"), KNOWN)


def test_a_proposed_experiment_leaves_the_idle_cylinder_alone(tmp_path):
    plan = propose(KNOWN, duration=4.0)
    plan.write(tmp_path / "plan.csv")
    again = read_plan(tmp_path / "plan.csv", KNOWN)
    along = np.array([math.cos(math.radians(30.0)), math.sin(math.radians(30.0))])
    np.testing.assert_allclose(again.target, along[:, None] * (along @ again.target), atol=1e-8)
    assert not again.added[:2].any()
    assert np.ptp(again.added[2:], axis=1).min() > 0.3


def test_nothing_of_the_first_cylinder_is_looked_for():
    names = [one.name for one in free_of(KNOWN)]
    assert "cylinder2.coulomb_friction" in names
    assert not [name for name in names if name.startswith(("cylinder1", "valve_p1", "valve_n1"))]


def test_the_rig_that_made_a_log_is_found(columns, tmp_path):
    short = {name: values[:2500] for name, values in columns.items()}
    found = birthsim.identify(written(short, tmp_path / "log.csv"), KNOWN, progress=False, friction_law="lugre")
    rows = {row.name: row for row in found.rows}
    assert found.rig.linkage == KNOWN.linkage
    for name, true, off in (("mechanics.mass", 3.6, 0.01), ("chambers.dead_volume", 14e-6, 0.02)):
        assert rows[name].value == pytest.approx(true, rel=off)
        assert rows[name].low < true < rows[name].high
    pressed = 2 * 2.5e5 * found.rig.cylinder2.pressure_friction
    assert found.rig.cylinder2.coulomb_friction + pressed == pytest.approx(15.0 + 2 * 2.5e5 * 5e-6, rel=0.02)
    assert not [line for line in found.words() if "cylinder 1" in line]
    with np.errstate(all="raise"):  # nothing is drawn of what the rig has not
        assert [path.name for path in residuals_figure(found, tmp_path)] == ["residuals.png", "residuals.svg"]
    assert "chamber P1" not in (tmp_path / "residuals.svg").read_text()
