"""Logs come back to the last bit from every kind of file, and each thing that is wrong with one is named in one line."""

import dataclasses
import json
import re
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from baselines.identification.log.log_columns import PISTONS, LogOptions
from baselines.identification.log.log_file import COLUMNS, FORCES, read_trial, write_trial
from baselines.logs.log import Column, Log, Series
from baselines.logs.table import read_table
from baselines.logs.writing import write_log
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry
from birthsim_env.tables.table import Reading
from tests.identification.trials import OWNER, part, trial

SHORT = part(trial(), 0, 2100)
Rows = dict[str, Array]


@pytest.mark.parametrize("suffix", [".parquet", ".mcap", ".csv"])
def test_a_trial_comes_back(suffix: str, tmp_path: Path) -> None:
    pytest.importorskip({".parquet": "pyarrow", ".mcap": "mcap", ".csv": "csv"}[suffix])
    forced = dataclasses.replace(SHORT, forces=np.random.default_rng(0).normal(size=SHORT.forces.shape))
    write_trial(forced, tmp_path / f"log{suffix}", OWNER)
    again = read_trial(tmp_path / f"log{suffix}", OWNER)
    for name in ("openings", "pressures", "positions", "forces"):
        # CSV has ten digits.
        exact = getattr(forced, name)
        assert np.allclose(
            getattr(again, name), exact, rtol=1e-9 if suffix == ".csv" else 0, atol=1e-12 if suffix == ".csv" else 0
        )
    assert again.period == pytest.approx(SHORT.period, rel=1e-9)


def rows() -> Rows:
    values = np.vstack([SHORT.times, SHORT.openings, SHORT.pressures, SHORT.positions, SHORT.forces])
    return {name: value.copy() for name, value in zip(COLUMNS, values, strict=True)}


def write(content: Rows, path: Path) -> None:
    lines = [",".join(content), *(",".join(f"{value:.10g}" for value in row) for row in zip(*content.values(), strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def counted(content: Rows) -> Rows:
    """The log of a rig with encoders."""
    place = np.array([content.pop("position_x"), content.pop("position_y")])
    return content | dict(zip(PISTONS, inverse_geometry(place, OWNER), strict=True))


@pytest.mark.parametrize("names", [PISTONS, ("Encoder 1 [mm]", "Encoder 2 [mm]")], ids=["by name", "mapped"])
def test_encoders_tell_where_the_head_is(names: tuple[str, str], tmp_path: Path) -> None:
    content = counted(rows())
    for name, other in zip(PISTONS, names, strict=True):
        content[other] = content.pop(name) * (1e3 if "mm" in other else 1.0)
    write(content, tmp_path / "log.csv")
    mapping = ",".join(f"{name}={other.split(' [')[0]}" for name, other in zip(PISTONS, names, strict=True))
    trial = read_trial(tmp_path / "log.csv", OWNER, LogOptions(columns=mapping if names != PISTONS else ""))
    np.testing.assert_allclose(trial.positions, SHORT.positions, atol=1e-9)


def test_counts_that_no_linkage_reaches_are_refused(tmp_path: Path) -> None:
    content = counted(rows())
    content["piston_y1"] += 1.0
    write(content, tmp_path / "log.csv")
    with pytest.raises(ValueError, match=r"piston_y1, piston_y2 of encoders: .*; allowed: "):
        read_trial(tmp_path / "log.csv", OWNER)


def test_without_forces_there_is_no_hand_and_a_recording_has_two(tmp_path: Path) -> None:
    content = rows()
    for name in FORCES:
        del content[name]
    write(content, tmp_path / "log.csv")
    with pytest.warns(UserWarning, match="has no force"):
        assert (read_trial(tmp_path / "log.csv", OWNER).forces == 0).all()
    for k, name in enumerate(("scenario_force_x", "scenario_force_y", "drag_force_x", "drag_force_y")):
        content[name] = np.full(len(SHORT.times), 1.0 + k)
    content["log_time"] = content.pop("time")
    write(content, tmp_path / "log.csv")
    assert (read_trial(tmp_path / "log.csv", OWNER).forces == [[4.0], [6.0]]).all()


def test_rows_that_are_a_little_early_or_late_are_taken_as_even(tmp_path: Path) -> None:
    content = rows()
    content["time"] += 0.2e-3 * np.random.default_rng(0).uniform(-1, 1, size=len(content["time"]))
    write(content, tmp_path / "log.csv")
    found = read_trial(tmp_path / "log.csv", OWNER)
    assert np.ptp(np.diff(found.times)) < 1e-9


def still_from(row: int, value: float) -> Callable[[Array], Array]:
    return lambda values: np.where(np.arange(len(values)) >= row, value, values)


def still(values: Array) -> Array:
    return np.full(len(values), values[0])


BAD: dict[str, tuple[dict[str, Callable[[Array], Array] | None], str]] = {
    # how the columns begin that are changed, and what becomes of their values; words of the refusal
    "columns": ({"pressures_N1": None, "position_y": None}, "lacks pressures_N1, position_y; there are: time, openings_P1"),
    "one force": ({"force_y": None}, "lacks force_y; there are: time"),
    "time": ({"time": None}, "lacks time; there are: openings_P1"),
    "nan": ({"pressures_P2": still_from(500, np.nan)}, "pressures_P2 is not finite in 1600 rows"),
    "time back": ({"time": still_from(500, 0.038)}, "row 500: time 0.038 after 0.499, and 1599 more such rows; allowed: inc"),
    "milliseconds": ({"time": lambda v: 1e3 * v}, "has a row every 1 s; allowed: a row every 0.25 to 10 ms, as often as the "
                     "valves are commanded; it looks like ms, allowed: s, or time (ms)"),
    "gap": ({"time": lambda v: v + 0.5 * (np.arange(len(v)) >= 1000)},
            "row 1000: 501 ms after the row before, others 1 ms; allowed: evenly spaced rows"),
    "volts": ({"openings": lambda v: 5 * v + 5}, "they look like V: --columns NAME=COLUMN*0.2-1 where 5 V is shut"),
    "percent": ({"openings": lambda v: 100 * v}, "they look like percent: an opening is percent / 100"),
    "valve": ({"openings_N2": still}, "openings_N2 never changes; allowed: valves that move, as in birthsim identify "),
    "bar": ({"pressures": lambda v: 1e-5 * v}, "they look like bar, allowed: absolute pressures in Pa"),
    "kPa": ({"pressures": lambda v: 1e-3 * v}, "they look like kPa, allowed: absolute pressures in Pa"),
    "gauge": ({"pressures": lambda v: v - 101300.0}, "looks like a gauge pressure in "),
    "supply": ({"pressures": lambda v: 2 * v}, "allowed: at most 1.1 times the rig's air.supply_pressure of 700000 Pa"),
    "cell": ({"pressures_P1": still}, "pressures_P1 stands still in 2100 rows"),
    "millimetres": ({"position": lambda v: 1e3 * v}, "they look like mm, allowed: m"),
    "samples": ({"position": lambda v: np.repeat(v[::700], 700)[: len(v)]},
                "the position changes 2 times; allowed: at least 50 samples of the tracker"),
    "one axis": ({"position_x": still}, "position_x never changes; allowed: a log of a rig that moves"),
    "rest": ({"position": still}, "the position never changes; allowed: a log of a rig that moves"),
    "short": ({"": lambda v: v[:500]}, "holds 0.499 s; allowed: at least 2 s"),
    "one row": ({"": lambda v: v[:1]}, "has 1 rows; allowed: at least 2 s of them"),
    "origin": ({"position": lambda v: v + 0.4}, "position is outside of the workspace in 2100 rows"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_with_a_log_is_named(case: str, tmp_path: Path) -> None:
    (changes, words), content = BAD[case], rows()
    for begins, change in changes.items():
        for name in (one for one in content if one.startswith(begins)):
            content[name] = change(content[name]) if change else None
    write({name: values for name, values in content.items() if values is not None}, tmp_path / "log.csv")
    with pytest.raises(ValueError, match=re.escape(words)) as error:
        read_trial(tmp_path / "log.csv", OWNER)
    assert str(error.value).startswith("log = '")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mcap"])
def test_what_would_take_too_much_memory_is_refused(suffix: str, tmp_path: Path) -> None:
    rows = {"time": np.arange(5000.0), "a": np.zeros(5000)}
    path = tmp_path / f"log{suffix}"
    if suffix == ".csv":
        path.write_text("time,a\n" + "0,\n" * 5000)
    else:
        pytest.importorskip("mcap.writer" if suffix == ".mcap" else "pyarrow")
        columns = {name: Column("1", "") for name in rows}
        write_log(Log(columns, [Series("/rig", rows["time"], rows)], [], {}), path)
    assert len(read_table(path).columns["a"]) == 5000
    with pytest.raises(ValueError, match=rf"log{re.escape(suffix)}'.*allowed"):
        read_table(path, Reading(most=path.stat().st_size + 1000))


def test_a_csv_file_takes_little_more_memory_than_its_bytes_and_numbers(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,a\n" + "0.123456,0.123456\n" * 20_000)
    size = (tmp_path / "log.csv").stat().st_size
    tracemalloc.start()
    table = read_table(tmp_path / "log.csv", Reading(most=2 * size))  # which reading sets aside at first
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(table.columns["a"]) == 20_000
    assert peak < 2 * (size + 8 * 2 * 20_000)


@pytest.mark.parametrize("value", [None, [1.0], "one", 10**400])
def test_what_is_no_number_in_a_message_is_named_by_its_row(value: object, tmp_path: Path) -> None:
    writer = pytest.importorskip("mcap.writer", reason="mcap is not installed: pip install -e '.[log]'").Writer
    content = rows()
    with (tmp_path / "log.mcap").open("wb") as file:
        log = writer(file)
        log.start()
        channel = log.register_channel("/rig", "json", log.register_schema("rig", "jsonschema", b"{}"))
        for row in range(len(content["time"])):
            message = {name: float(values[row]) for name, values in content.items()} | (
                {"position_x": value} if row == 9 else {}
            )
            log.add_message(channel, row, json.dumps(message).encode(), row)
        log.finish()
    if value is not None:  # what was never a number says that the column is another one
        own = "message of /rig .*401 digits.*; allowed: JSON" if value == 10**400 else "position_x.*row 9: .*; allowed: numbers"
        with pytest.raises(ValueError, match=own):
            read_trial(tmp_path / "log.mcap", OWNER)
        return
    (note,) = read_trial(tmp_path / "log.mcap", OWNER).notes
    assert re.search("position is not finite in 1 row .row 9 at 0.009 s: .nan, ", note)
