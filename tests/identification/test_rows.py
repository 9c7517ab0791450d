"""Rows that no rig makes are left out of a log and named; a log with many of them is refused with the cause."""

import re

import numpy as np
import pytest

from baselines.identification.log.rows import checked_trial
from baselines.identification.log.trial import Trial
from tests.identification.broken import (
    ALL,
    ROWS,
    Change,
    capped,
    changed,
    columns,
    doubled,
    exchanged,
    hung,
    put,
    scattered,
    shifted,
    stuck,
    times,
    without,
)
from tests.identification.trials import OWNER

LEFT_OUT: dict[str, tuple[Change, str, dict[str, int]]] = {
    # what is done to the log; words of the note; numbers per signal that are left out
    "far away": (
        put("positions", 2000, (12.0, -7.0)),
        r"position .*row 2000 at 2 s: \(12, -7\) m.*distance 0.3 to 0.7 m",
        {"positions": 2},
    ),
    "zero fix": (put("positions", 2000, 0.0), r"position .*\(0, 0\) m.*distance 0.3 to 0.7 m", {"positions": 2}),
    "zero fixes": (put("positions", slice(1500, 1700), 0.0), "position .*in 200 rows .*rows 1500 to 1699", {"positions": 400}),
    "huge pressure": (
        put("pressures", 2000, 6e6, 0),
        r"pressures_P1 .*row 2000 at 2 s: 6e\+06 Pa.*1.1 times",
        {"pressures": 1},
    ),
    "no pressure": (put("pressures", 7, 0.0, 3), "pressures_N2 .*row 7 at 0.007 s: 0 Pa.*81040 Pa or more", {"pressures": 1}),
    "pressure spike": (
        put("pressures", 2500, 1.4e5, 1),
        "pressures_N1 .*row 2500 .*140000 Pa.*air can follow",
        {"pressures": 1},
    ),
    "no signal": (put("positions", slice(1500, 1700), np.nan), "position is not finite in 200 rows", {"positions": 400}),
    "inf": (put("pressures", [3, 9], np.inf, 2), "pressures_P2 is not finite in 2 rows .*row 3 .*row 9 ", {"pressures": 2}),
    "largest float": (put("positions", 4, 1e308), "position .*row 4 ", {"positions": 2}),
    "converter": (put("openings", [5, 90], -32768.0, 1), "openings_N1 .*row 5 .*-32768.*-1 to 1", {}),
    "opening lost": (put("openings", 90, np.nan, 1), "openings_N1 is not finite in 1 row ", {}),
    "force spike": (put("forces", [5, 700], 1e4), "force .*2 rows .*10000.*force_range of 300 N", {}),
    "force jolt": (put("forces", 700, 90.0, 0), r"force .*\(90, 0\) N.*longer than two rows", {}),
    "force lost": (put("forces", 700, np.nan), "force is not finite in 1 row ", {}),
    "lost tracker": (stuck("positions", 1500, 1700), "position stands still while the head moves", {"positions": 404}),
    "lost cell": (stuck("pressures", 1500, 1700, 1), "pressures_N1 stands still in 200 rows", {"pressures": 200}),
    "elsewhere": (shifted("positions", 2000, 2100, 0.03), "position .*rows 2000 to 2099.*motion", {"positions": 200}),
    "saturated": (capped("positions", 0.93), "position stays at the end of its range", {}),
    "missing rows": (
        without([500, 501, 1700]),
        "3 rows are missing: 2 after row 499 .*, 1 after row 1697",
        {"positions": 6, "pressures": 12},
    ),
    "logger hangs": (
        hung(1500, 2000),
        r"repeats one row in all its columns, rows 1501 to 1999 .*499 such rows",
        {"positions": 998, "pressures": 1996},
    ),
    "gap": (without(slice(1000, 1200)), "200 rows are missing: 200 after row 999", {"positions": 400, "pressures": 800}),
    "row twice": (doubled(1000), r"time is repeated.*row 1000 \(1 s\); left out", {}),
    "time lost": (put("times", 1000, np.nan), r"time .*row 1000 \(nan s\); put between", {}),
    "time goes back": (put("times", 1000, 0.5), r"time .*row 1000 \(0.5 s\); put between", {}),
    "time at the end": (put("times", [0, ROWS - 1], 1e30), r"time .*row 0 .*row 2999 \(1e\+30 s\); left out", {}),
    "hung force": (put("forces", ALL, (5.0, 0.0)), r"force is \(5, 0\) N in every row", {}),
}


def left(log: Trial, name: str) -> int:
    return int(np.isnan(getattr(log, name)).sum())


@pytest.mark.parametrize("case", LEFT_OUT)
def test_a_few_wrong_rows_are_left_out_and_named(case: str) -> None:
    change, words, missing = LEFT_OUT[case]
    found = checked_trial("log", changed(change), OWNER)
    assert any(re.search(words, note) for note in found.notes), found.notes
    for name, count in missing.items():
        assert left(found, name) == count
    assert np.isfinite(found.openings).all()
    assert np.isfinite(found.forces).all()
    assert np.abs(found.openings).max() <= 1.0
    assert np.allclose(np.diff(found.times), 1e-3)


def test_what_is_left_out_is_all_that_changes() -> None:
    good, found = columns(), checked_trial("log", changed(scattered("positions", 0.002, 9.0)), OWNER)
    known = np.isfinite(found.positions)
    assert 0 < left(found, "positions") < 0.01 * known.size
    assert (found.positions[known] == good["positions"][known]).all()
    assert (found.pressures == good["pressures"]).all()


def test_openings_and_forces_are_bridged_and_long_gaps_are_marked() -> None:
    found = checked_trial("log", changed(put("openings", [90, 91], np.nan), put("forces", slice(1000, 1100), np.inf)), OWNER)
    before, after = columns()["openings"][:, 89], columns()["openings"][:, 92]
    assert np.allclose(found.openings[:, 90], (2 * before + after) / 3)
    assert found.unknown is not None
    assert (np.flatnonzero(found.unknown) == np.arange(1000, 1100)).all()


@pytest.mark.parametrize(
    "change",
    [
        lambda log: np.copyto(log["positions"], 1e-4 * np.round(log["positions"] / 1e-4)),
        lambda log: np.copyto(log["pressures"], 244.0 * np.round(log["pressures"] / 244.0)),
        lambda log: np.copyto(log["positions"], np.repeat(log["positions"][:, ::20], 20, axis=1)[:, :ROWS]),
        times("times", 1.0, 1.7e9),
    ],
    ids=["coarse tracker", "coarse cells", "slow tracker", "epoch"],
)
def test_a_sensor_that_rounds_or_holds_is_no_fault(change: Change) -> None:
    found = checked_trial("log", changed(change), OWNER)
    assert found.notes == ()
    assert not np.isnan(found.positions).any()
    assert not np.isnan(found.pressures).any()


REFUSED: dict[str, tuple[Change, str]] = {
    "zeros": (put("positions", slice(0, None, 5), 0.0), r"position .*in 600 rows.*allowed: distance 0.3 to 0.7 m"),
    "no positions": (put("positions", ALL, np.nan), "position is not finite in 3000 rows"),
    "no cell": (put("pressures", ALL, np.nan, 1), "pressures_N1 is not finite in 3000 rows"),
    "tracker stops": (stuck("positions", 1500, ROWS), "position stands still while the head moves .*rows 1[45].. to 2999"),
    "jump that stays": (shifted("positions", 1500, ROWS, 0.03), "position .*by a jump"),
    "cells end too early": (capped("pressures", 0.7), "pressures_P1 stays at the end"),
    "cm": (times("positions", 100.0), "look like cm, allowed: m"),
    "inches": (times("positions", 1 / 0.0254), "look like inches, allowed: m"),
    "x is y": (exchanged("positions", 0, 1), "position_x and position_y look exchanged"),
    "x points back": (times("positions", -1.0, axis=0), r"position = \(-|position is outside"),
    "one cell in bar": (
        times("pressures", 1e-5, axis=2),
        "pressures_P2 about .*look like bar, allowed: absolute pressures in Pa",
    ),
    "psi": (times("pressures", 1 / 6895.0), "look like psi"),
    "MPa": (times("pressures", 1e-6), "look like MPa"),
    "cells exchanged": (exchanged("pressures", 0, 1), "pressures_P1 follows openings_N1; columns look exchanged"),
    "valves exchanged": (exchanged("openings", 1, 3), "pressures_N1 follows openings_N2; columns look exchanged"),
    "valve the other way": (times("openings", -1.0, axis=2), "pressures_P2 falls where openings_P2 is above 0"),
    "volts about zero": (times("openings", 10.0), r"look like V: .*COLUMN\*0\.1"),
    "converter's numbers": (times("openings", 32767.0), "look like numbers of a converter"),
    "force in mN": (times("forces", 1.0, 4000.0), "force is too large in 3000 rows .*force_range of 300 N"),
    "long gap": (without(slice(1000, 1500)), "row 1000: 501 ms after the row before.*10 % are missing"),
    "two logs": (
        lambda log: np.copyto(log["times"][1500:], log["times"][:1500]),
        "row 1500: time 0 after 1.499, .*increasing times",
    ),
    "one time": (put("times", ALL, 1.0), "row 1: time 1 after 1.*increasing times"),
    "no time": (put("times", ALL, np.nan), "row 1: time nan after nan.*increasing times"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_many_wrong_rows_and_wrong_units_are_refused_by_name(case: str) -> None:
    change, words = REFUSED[case]
    with pytest.raises(ValueError, match=words) as error:
        checked_trial("log", changed(change), OWNER)
    assert "allowed" in str(error.value)
    assert "\n" not in str(error.value)
