"""A log's columns under other names and units; a force is found, or named, and never read as zero in silence."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from baselines.identification.log.log_columns import COLUMNS, LogOptions, read_columns
from birthsim_env.physics.compiled.lanes import Array
from tests.tables.test_packed_files import mcap

ROWS = 5
FORCES = {"force_x": 7.0, "force_y": -3.0}


def content(names: dict[str, str] | None = None) -> dict[str, Array]:
    """Columns of a log, some of which have other names."""
    rng = np.random.default_rng(0)
    values = {name: rng.normal(size=ROWS) for name in COLUMNS}
    values |= {"time": 1e-3 * np.arange(ROWS), **{name: np.full(ROWS, force) for name, force in FORCES.items()}}
    return {(names or {}).get(name, name): column for name, column in values.items()}


def read(path: Path, rows: dict[str, Array], **options: object) -> dict[str, Array]:
    lines = [",".join(rows), *(",".join(f"{value:.17g}" for value in row) for row in zip(*rows.values(), strict=True))]
    (path / "log.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    source, found = read_columns(path / "log.csv", LogOptions(**options))  # type: ignore[arg-type]
    assert source == f"log = '{path / 'log.csv'}'"
    return found


SAME = [
    *(("Fx", "Fy"), ("FX", "FY"), ("force_x [N]", "force_y [N]"), ("Force_x", "FORCE_Y"), ("F_x (N)", "F_y (N)")),
    *(("forceX", "forceY"), ("force.x", "force.y"), ("Force X [mN]", "Force Y / mN"), ("Fx_kN", "Fy_kN"), (" fx", "fy ")),
    *(("hand_force_x", "hand force y"), ("forcex", "forcey")),
]


@pytest.mark.parametrize(("x", "y"), SAME)
def test_a_force_under_another_name_is_a_force(x: str, y: str, tmp_path: Path) -> None:
    factor = 1e3 if "kN" in x else 1e-3 if "mN" in x else 1.0
    found = read(tmp_path, content({"force_x": x, "force_y": y}))
    np.testing.assert_allclose([found["force_x"][0], found["force_y"][0]], [7 * factor, -3 * factor])


def test_one_voltage_moves_both_valves_of_a_cylinder(tmp_path: Path) -> None:
    """Where two 3/2 valves hang on one output, N the other way round; so are two cylinders' logs in volts read."""
    names = {"openings_P1": "u1 [V]", "openings_P2": "u2 [V]"}
    columns = {name: values for name, values in content(names).items() if not name.startswith("openings_N")}
    columns["u1 [V]"], columns["u2 [V]"] = np.array([5.0, 6.0, 7.0, 4.0, 10.0]), np.full(ROWS, 2.5)
    said = "openings_P1=u1*0.2-1,openings_N1=u1*-0.2+1,openings_P2=u2*.2-1.0,openings_N2=u2*-2e-1+1"
    found = read(tmp_path, columns, columns=said)
    np.testing.assert_allclose(found["openings_P1"], [0.0, 0.2, 0.4, -0.2, 1.0], atol=1e-12)
    np.testing.assert_allclose(found["openings_N1"], -found["openings_P1"], atol=1e-12)
    np.testing.assert_allclose(found["openings_N2"], 0.5, atol=1e-12)


LIKE = [
    *(("Fz", "Ft"), ("Fx_filt", "Fy_filt"), ("frc_x", "frc_y"), ("force_1", "force_2"), ("force", "foo"), ("Kraft_x", "q")),
    *(("load_x [N]", "load_y [N]"), ("loadCell1", "q"), ("wrench.x", "wrench.y"), ("ATI_Fx", "ATI_Fy"), ("fx raw (kg)", "q")),
    *(("FT_x", "FT_y"), ("scenario_force_x", "q"), ("F [N]", "q"), ("F", "q")),
    *(("F_hand_x", "F_hand_y"), ("F_hx", "F_hy"), ("Fh_x", "Fh_y"), ("fhx", "fhy"), ("FX1", "FY1"), ("load_x", "load_y")),
    *(("hand_x", "hand_y"), ("hand", "q"), ("tensionX", "tensionY"), ("effort_x_N", "q"), ("aN", "bN"), ("ftsensor", "q")),
]


@pytest.mark.parametrize(("x", "y"), LIKE)
def test_what_may_be_a_force_is_not_left_out(x: str, y: str, tmp_path: Path) -> None:
    columns = content({"force_x": x, "force_y": y})
    with pytest.raises(
        ValueError, match=r"force_x, force_y, but .* may be a force; allowed: --columns force_x=COLUMN,"
    ) as error:
        read(tmp_path, columns)
    assert x.partition(" ")[0] in str(error.value)
    if "kg" not in x:
        name = x.partition(" [")[0]
        assert read(tmp_path, columns, columns=f"force_x={name},force_y={y.partition(' [')[0]}")["force_x"][0] == 7.0
    with pytest.warns(UserWarning, match="not used: ") as said:
        found = read(tmp_path, columns, columns="force_x=none,force_y=none")
    assert not found["force_x"].any()
    assert len(said) == 1


def test_what_is_not_used_is_named_and_no_force_is_said(tmp_path: Path) -> None:
    columns = {name: values for name, values in content().items() if name not in FORCES}
    with pytest.warns(UserWarning, match="log.csv") as said:
        found = read(tmp_path, columns | {"temperature": np.zeros(ROWS)})
    assert not found["force_x"].any()
    words = [str(one.message).partition("log.csv'")[2] for one in said]
    assert words == [
        ": columns that are not used: temperature",
        " has no force; it is taken as 0, as where nobody touches the rig",
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(tmp_path, content())


@pytest.mark.parametrize(
    ("names", "options", "words"),
    [
        ({"pressures_N1": "presure_N1"}, {}, r"lacks pressures_N1 \(pressures_N1: did you mean 'presure_N1'\?\); there are: "),
        ({"force_y": "q"}, {}, "lacks force_y; there are: .*allowed: --columns NAME=COLUMN.*NAME=none for a force"),
        ({"time": "sample"}, {}, "lacks time; there are: sample, .*allowed: --columns"),
        ({"pressures_P1": "pressures_P1 [barg]"}, {}, "'pressures_P1' in barg; allowed: absolute pressures in .*Pa.*bar"),
        ({"openings_P1": "openings_P1 [V]"}, {}, "'openings_P1' in V; allowed: no unit, 1, -, %"),
        ({}, {"columns": "time=none"}, "time=none; allowed: a column, and none for force_x, force_y only"),
        ({}, {"columns": "forcex=Fz"}, r"--columns .*'forcex' \(did you mean 'force_x'\?\); allowed: NAME=COLUMN"),
        ({}, {"columns": "force_x=Fz"}, "no column 'Fz' for force_x; allowed: time"),
        ({"force_x": "Fz", "force_y": "q"}, {"columns": "force_x=Fz"}, "lacks force_y"),
        ({}, {"skip": 99}, "has no lines of numbers; allowed: a line of names"),
    ],
)
def test_what_a_log_lacks_is_named(names: dict[str, str], options: dict[str, object], words: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=words):
        read(tmp_path, content(names), **options)


def test_units_of_headings_are_taken_into_si_and_rows_are_no_times(tmp_path: Path) -> None:
    pressures = {name: f"{name} [bar]" for name in COLUMNS if name.startswith("pressures")}
    openings = {name: f"{name} [%]" for name in COLUMNS if name.startswith("openings")}
    columns = content({"time": "t (ms)", "position_x": "x (mm)", "position_y": "y_mm", **pressures, **openings})
    found = read(tmp_path, columns)
    factors = {
        "time": 1e-3,
        "position_x": 1e-3,
        "position_y": 1e-3,
        **dict.fromkeys(pressures, 1e5),
        **dict.fromkeys(openings, 1e-2),
    }
    for name, exact in content().items():
        np.testing.assert_allclose(found[name], exact * factors.get(name, 1.0), rtol=1e-12, err_msg=name)
    for name in ("time", "t"):
        with pytest.raises(ValueError, match=r"a row every 1 s; allowed: .*looks like ms, .*row numbers, which are no times"):
            read(tmp_path, content({"time": name}) | {name: np.arange(1.0, ROWS + 1)})


def test_one_mapped_axis_the_other_without_a_force(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="not used: q"):
        found = read(tmp_path, content({"force_x": "Fz", "force_y": "q"}), columns="force_x=Fz,force_y=none")
    assert (found["force_x"][0], found["force_y"][0]) == (7.0, 0.0)


def test_a_force_in_another_channel_is_not_left_out(tmp_path: Path) -> None:
    rows = {name: float(column[0]) for name, column in content().items() if name not in FORCES}
    path = mcap(tmp_path / "own.mcap", [("/rig", rows), ("/hand", {"x": 7.0, "y": -3.0}), ("/imu", {"a": 1})])
    with pytest.raises(ValueError, match=r"but /hand.x, /hand.y, which is not read, may be a force; allowed: all columns"):
        read_columns(path, LogOptions())
    with pytest.warns(UserWarning, match="not read: /hand, /imu"):
        assert not read_columns(path, LogOptions(columns="force_x=none,force_y=none"))[1]["force_x"].any()


def test_units_that_are_not_known_are_not_taken_for_newtons(tmp_path: Path) -> None:
    lines = [",".join(COLUMNS), "s,,,,,Pa(a),Pa(a),Pa(a),Pa(a),m,m,ozf,ozf", *[",".join("1" * len(COLUMNS))] * 2]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"has 'pressures_P1' in Pa\(a\); allowed: absolute pressures in "):
        read_columns(tmp_path / "log.csv", LogOptions())


def test_a_log_needs_a_heading(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("0,1,2\n1,2,3\n")
    with pytest.raises(ValueError, match="has no heading; allowed: a line that names time, openings_P1, "):
        read_columns(tmp_path / "log.csv", LogOptions())
