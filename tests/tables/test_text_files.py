"""Tables of text: every dialect says the same numbers to everything that reads tables; what is no table is named."""

import ast
import re
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from baselines.identification.experiment import NAMES
from baselines.logs.table import read_table
from birthsim_env.parts.own_parts import COURSE, FORCE
from birthsim_env.physics.compiled.sources import files_of
from birthsim_env.tables.columns import columns, table_file
from birthsim_env.tables.table import Reading
from tests.console import ROOT

NUMBERS = np.array([[0.0, 0.5, -0.25], [1.0, 0.51, 0.125], [2.0, 0.5, 0.0], [3.5, 1e-3, 7.0]])
PACKAGES = ("birthsim", "birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_drive", "birthsim_live")


def written(heading: str = "time,x,y", separator: str = ",", after: str = "", numbers: np.ndarray = NUMBERS) -> str:
    lines = [heading, *(",".join(f"{value:.10g}" for value in row) + after for row in numbers)]
    return "\n".join(lines).replace(",", separator) + "\n"


LABVIEW = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\t\n\nChannels\t2\n"
    "Samples\t4\t4\nDate\t2010/03/04\t2010/03/04\nX_Dimension\tTime\tTime\nX0\t0.0\t0.0\nDelta_X\t0.001\t0.001\n"
    "***End_of_Header***\t\t\n"
)
MILLI = NUMBERS * 1e3
PLAIN = written()

DIALECTS: dict[str, str | bytes] = {
    "plain": PLAIN,
    "numpy.savetxt": written("# time,x,y"),
    "numpy.savetxt, its own separator": written("# time x y", " "),
    "MATLAB's remarks": "% my log\n" + written("% time,x,y"),
    "units in parentheses": written("time (s),x (m),y (m)"),
    "units in brackets": written("Time [s],X [m],Y[m]"),
    "units behind a slash": written("time / s,x/m,y / m"),
    "units behind the name": written("time_s,x_m,y_m"),
    "other units": written("t [ms],x (mm),y_mm", numbers=MILLI),
    "a row of units": written("time,x,y\ns,m,m"),
    "a row of units in brackets": written("time,x,y\n[s],(m),[m]"),
    "a row of other units": written("time,x,y\nms,mm,mm", numbers=MILLI),
    "another case": written("TIME,X,Y"),
    "other names": written("t,position_x,pos_y"),
    "camel case": written("elapsedTime,positionX,positionY"),
    "tabs": written(separator="\t"),
    "semicolons": written(separator=";"),
    "blanks": written(separator="   "),
    "bars": written(separator=" | "),
    "Excel says the separator": "sep=;\n" + written(separator=";"),
    "commas at the ends": written(after=","),
    "commas at the ends, of the heading too": written("time,x,y,", after=","),
    "quoted": '"time","x","y"\n' + "\n".join(",".join(f'"{value}"' for value in row) for row in NUMBERS.tolist()),
    "Windows": PLAIN.replace("\n", "\r\n"),
    "an old Macintosh": PLAIN.replace("\n", "\r"),
    "blank lines and remarks": "# mine\n\n" + PLAIN.replace("\n1,", "\n\n# break\n1,"),
    "a byte-order mark": "\ufeff" + PLAIN,
    "UTF-16": PLAIN.encode("utf-16"),
    "UTF-32": PLAIN.encode("utf-32"),
    "Fortran": "time,x,y\n" + "\n".join(",".join(f"{value:.17e}".replace("e", "D") for value in row) for row in NUMBERS),
    "tabs at the ends": PLAIN.replace("\n", "\t\n"),
    "Unicode minus": PLAIN.replace("-", "\u2212"),
}
NOTED: dict[str, tuple[str | bytes, str]] = {
    "Windows-1252": (("# 20 \xb0C\n" + PLAIN).encode("cp1252"), "Windows-1252"),
    "LabVIEW": (LABVIEW + written("X_Value,x,y,Comment", "\t"), "line 14"),
    "National Instruments": ("Operator: Max\nDate: 2024\nSampling rate,1000\n\n" + PLAIN, "line 5"),
    "dSPACE": ("data_format,Raster\ntrace_names\npath,a,b\n" + written("time,x,y\nunit,m,m"), "line 4"),
    "two headings": (written("log,log,log\ntime,x,y"), "line 2"),
    "a row of words below": (written("time,x,y\nthe time,along,across\ns,m,m"), "line 1; .*: 1"),
    "a block before remarks in words": (
        "Laboratory\nOperator,Max\nfoo,1\n\ntime,x,y,said\nms,mm,mm,\n" + "\n".join(f"{t},{x},{y},go" for t, x, y in MILLI),
        "line 5",
    ),
    "pandas": (written(",time,x,y", numbers=np.column_stack([np.arange(4), NUMBERS])), "column 1"),
    "a remark in words": ("time,x,y,remark\n" + "\n".join(f"{t},{x},{y},go" for t, x, y in NUMBERS), "remark"),
    "two columns of no use": (written("time,a,x,a,y", numbers=NUMBERS[:, [0, 0, 1, 0, 2]]), "not used: a"),
    "dates": ("time,x,y\n" + "\n".join(f"2024-02-28T23:59:5{6 + t}Z,{x},{y}" for t, x, y in NUMBERS), "counted from the first"),
    "times of a day": ("time,x,y\n" + "\n".join(f"23:59:{50 + t},{x},{y}" for t, x, y in NUMBERS), "counted from the first"),
}


def course(path: Path) -> np.ndarray:
    return columns("reference", (path, ""), COURSE, ("time", "x", "y"))


@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_dialect_says_the_same_numbers(dialect: str, tmp_path: Path) -> None:
    text = DIALECTS[dialect]
    (tmp_path / "own.CSV").write_bytes(text if isinstance(text, bytes) else text.encode())
    np.testing.assert_allclose(course(tmp_path / "own.CSV"), NUMBERS, rtol=1e-12)
    table = read_table(tmp_path / "own.CSV")
    assert (table.rows, len(table.columns), table.faults) == (4, 3, {})


@pytest.mark.parametrize("dialect", NOTED)
def test_what_is_left_out_or_taken_otherwise_is_said(dialect: str, tmp_path: Path) -> None:
    text, words = NOTED[dialect]
    (tmp_path / "own.txt").write_bytes(text if isinstance(text, bytes) else text.encode())
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = course(tmp_path / "own.txt")
    said = [str(one.message) for one in caught]
    np.testing.assert_allclose(found, NUMBERS, rtol=1e-12, atol=1e-12)
    assert all("own.txt" in line and "\n" not in line for line in said)
    assert any(re.search(words, line) for line in said), said


@pytest.mark.parametrize("units", [COURSE, FORCE, NAMES], ids=["course", "hand", "plan"])
def test_dialects_of_whoever_reads(units: dict[str, str], tmp_path: Path) -> None:
    numbers = np.arange(4.0 * len(units)).reshape(4, -1)
    heading = ",".join(f"{name.upper()} [{unit}]" for name, unit in units.items())
    (tmp_path / "own.tsv").write_text("# mine\n" + written(heading, "\t", numbers=numbers), encoding="utf-16")
    np.testing.assert_array_equal(columns("x", (tmp_path / "own.tsv", ""), units, tuple(units)), numbers)


def test_decimal_commas_where_they_are_asked_for(tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text(written(separator=";").replace(".", ","))
    found = read_table(tmp_path / "own.csv", Reading(decimal_comma=True))
    np.testing.assert_allclose(np.array(list(found.columns.values())).T, NUMBERS, rtol=1e-12)
    quoted = "\n".join(",".join(f'"{value}"'.replace(".", ",") for value in row) for row in NUMBERS.tolist())
    for text in (written(separator=" ").replace(".", ","), f"time,x,y\n{quoted}"):
        (tmp_path / "own.csv").write_text(text)
        found = read_table(tmp_path / "own.csv", Reading(decimal_comma=True))
        np.testing.assert_allclose(np.array(list(found.columns.values())).T, NUMBERS, rtol=1e-12)
    (tmp_path / "own.csv").write_text(PLAIN.replace(",", ";"))
    with pytest.raises(ValueError, match=r"'x': line 2: '0.5' .*allowed: decimal commas"):
        read_table(tmp_path / "own.csv", Reading(decimal_comma=True)).column("x")


def test_lines_are_skipped_where_it_is_asked_for(tmp_path: Path) -> None:
    block = "Laboratory\nOperator,Max\nfoo,1\n\n"
    (tmp_path / "own.csv").write_text(block + "a,b,remark\n0,0.5,none of it\n1,0.25,go\n")
    with pytest.raises(ValueError, match=r"line 2: 'Operator,Max'; allowed: .*--skip"):
        read_table(tmp_path / "own.csv", Reading(has_options=True))
    table = read_table(tmp_path / "own.csv", Reading(skip=4))
    np.testing.assert_array_equal(table.column("b"), [0.5, 0.25])
    assert table.notes == ()
    with pytest.raises(ValueError, match=r"column 'remark': line 6: 'none of it' is no number; allowed: numbers"):
        table.column("remark")


REFUSED: dict[str, tuple[str | bytes, str]] = {
    "thousands": ('time,x,y\n0,"1,234.5",0\n1,1,1\n', "'x': line 2: '1,234.5'.*thousands.*allowed: 1234.5"),
    "German thousands": ("time;x;y\n0;1.234,5;0\n1;1;1\n", "thousands.*allowed: 1234.5"),
    "spaced thousands": ("time;x;y\n0;1 234;0\n1;1;1\n", "thousands.*allowed: 1234"),
    "a comma that may be either": ('time,x,y\n0,"1,234",0\n1,1,1\n', "decimal one or separate thousands"),
    "decimal commas": ("time;x;y\n0;0,5;0\n1;0,5;1\n", "'x': line 2: '0,5'.*decimal comma.*allowed: a decimal point"),
    "an underscore": ("time,x,y\n0,1_0,0\n1,1,1\n", "'1_0' is no number"),
    "a unit in a cell": ("time,x,y\n0,0.5 m,0\n1,1,1\n", "'0.5 m'.*a unit.*allowed: the unit in the heading"),
    "percent in a cell": ("time,x,y\n0,5 %,0\n1,1,1\n", "'5 %'.*a unit"),
    "complex": ("time,x,y\n0,1+2j,0\n1,1,1\n", "complex.*allowed: a real number"),
    "another date": ("time,x,y\n01.05.2024 10:00,1,0\n1,1,1\n", "a date or a time of day, allowed: s, or 2024-05-01T10"),
    "dates and numbers": ("time,x,y\n2024-05-01,1,0\n1,1,1\n", "'time': line 3: '1' is no number"),
    "numbers and dates": ("time,x,y\n0,1,0\n2024-05-01,1,1\n", "'time': line 3: '2024-05-01'"),
    "no such day": ("time,x,y\n2024-02-30,1,0\n1,1,1\n", "'2024-02-30'"),
    "a unit unknown": ("time,x [furlong],y\n0,1,0\n1,1,1\n", "'x' in furlong; allowed: m, cm, mm"),
    "a unit of another kind": ("time,x,y\ns,m,N\n0,1,0\n1,1,1\n", "'y' in N; allowed: m, cm, mm"),
    "a unit that may be two": ("time,Fx (mn),Fy\n0,1,0\n1,1,1\n", "lacks x, y"),
    "nan": ("time,x,y\n0,NaN,0\n1,1,1\n", "line 2: x = nan; allowed: finite numbers"),
    "an Excel error": ("time,x,y\n0,1,0\n1,#N/A,1\n", "line 3: x = nan; allowed: finite numbers"),
    "a gap": ("time,x,y\n0,1,0\n1,,1\n", "line 3: x = nan; allowed: finite numbers"),
    "inf": ("time,x,y\n0,1,0\n1,1,inf\n", "line 3: y = inf; allowed: finite numbers"),
    "too few cells": ("time,x,y\n0,1,0\n1,1\n2,2,2\n", "line 3: '1,1'; allowed: 3 numbers, for time, x, y"),
    "too many cells": ("time,x,y\n0,1,0\n1,1,1,1\n2,2,2\n", "line 3: '1,1,1,1'; allowed: 3 numbers"),
    "a foot": (PLAIN + "End of file\n", "line 6: 'End of file'; allowed: 3 numbers"),
    "an open quote": ('time,x,y\n0,"1,0\n1,1,1\n', "line 2: .*allowed: 3 numbers"),
    "units, one of them unknown": ("time,x,y\nms,furlong,furlong\n0,1,0\n1,1,1\n", "'x' in furlong; allowed: m, cm, mm"),
    "decimal commas, a cell too few": ("time;x;y;z\n0,0;0,5;0,1\n", "of '0,0': it has a decimal comma, allowed: a decimal"),
    "twice": ("time,x,x,y\n0,1,1,0\n1,1,1,1\n", "column 'x': is there more than once; allowed: one"),
    "either of two": (
        "time,pos_x,position_x_m,px,y\n0,1,2,1,0\n1,1,1,1,1\n",
        "pos_x and position_x.*may each be x; allowed: one",
    ),
    "a name not there": ("time,xx,y\n0,1,0\n1,1,1\n", r"lacks x; there are: time, xx, y; allowed: .*own.csv:NAMES"),
    "back in time": ("time,x,y\n0,1,0\n1,1,1\n0.5,1,1\n", "line 4: time 0.5 after 1; allowed: .*increasing times"),
    "one row": ("time,x,y\n0,1,0\n", "has 1 rows.*at least 2"),
    "no rows": ("time,x,y\n", "has 0 rows.*at least 2"),
    "nothing": ("", "is empty; allowed: a line of names"),
    "zeros": (bytes(200), "is empty; allowed: a line of names"),
    "a remark alone": ("# hello\n", "has no lines of numbers; allowed: a line of names"),
    "UTF-16 without a mark": (PLAIN.encode("utf-16-le"), "UTF-16 without a byte-order mark; allowed: text in UTF-8"),
    "a loss of power": (PLAIN.encode() + bytes(64), "ends in zero bytes; allowed: text in UTF-8"),
    "no units, but dashes": ("time,x,y\n-,-,-\n0,1,1\n", "line 2: time = nan, x = nan"),
    "no text": (b"\x89PNG\r\n\0\0\0\x8d" + bytes(range(256)), "no text; allowed: text in UTF-8"),
    "half of UTF-16": (PLAIN.encode("utf-16")[:-1], "damaged utf-16 text .*allowed: text"),
    "two columns": ("0,1\n1,2\n", "2 columns and no heading; allowed: time, x, y, stiffness, the first 3"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_table_of_numbers_is_named(case: str, tmp_path: Path) -> None:
    text, words = REFUSED[case]
    (tmp_path / "own.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError, match=words) as error:
        course(tmp_path / "own.csv")
    assert str(error.value).startswith("reference = '")
    assert "\n" not in str(error.value)


MAPPED = "a,b,c\n0,1,2\n1,3,4\n"


@pytest.mark.parametrize("names", ["a,b,c", "time=a,x=b,y=c", "y=c , x=b,time=A"])
def test_a_user_says_what_columns_are_called(names: str, tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text(MAPPED)
    file = table_file(f"{tmp_path}/own.csv:{names}")
    assert file is not None
    np.testing.assert_array_equal(columns("reference", file, COURSE, ("time", "x", "y")), [[0, 1, 2], [1, 3, 4]])


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("a,b", "allowed: NAME=COLUMN,..., or a COLUMN for each of time, x, y"),
        ("time=a,b,c", "allowed: NAME=COLUMN"),
        ("time=a,tme=b", r"'tme' \(did you mean 'time'\?\); allowed: NAME=COLUMN"),
        ("time=a,x=b,y=b", "names one of them twice"),
        ("time=a,x=d,y=c", "no column 'd' for x; allowed: a, b, c"),
        ("time=a,x=,y=c", "x= without a column"),
        ("time=a,x=b", "lacks y; there are: a, b, c"),
    ],
)
def test_what_a_user_cannot_say(names: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text(MAPPED)
    file = table_file(f"{tmp_path}/own.csv:{names}")
    assert file is not None
    with pytest.raises(ValueError, match=words):
        columns("reference", file, COURSE, ("time", "x", "y"))


def test_a_hand_in_volts_has_a_factor_and_an_offset(tmp_path: Path) -> None:
    (tmp_path / "hand.csv").write_text("time,a [V],b\n0,2.5,1\n1,5,2\n")
    file = table_file(f"{tmp_path}/hand.csv:Fx=a*20-50,Fy=b * -1e1")
    assert file is not None
    np.testing.assert_allclose(columns("user_force", file, FORCE, tuple(FORCE)), [[0, 0, -10], [1, 50, -20]])


def test_columns_of_others_and_a_pipe_are_no_news(tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text("stiffness,time,x,y\n1000,0,0.5,0\n2000,1,0.5,0\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert course(tmp_path / "own.csv").shape == (2, 3)
        assert columns("stiffness", (tmp_path / "own.csv", ""), COURSE, ("time", "stiffness"))[1, 1] == 2000
    assert table_file("own.py:Name") is None
    assert table_file(3.0) is None
    assert table_file(tmp_path / "a.Parquet") == (tmp_path / "a.Parquet", "")


READERS = {
    "csv.reader",
    "csv.DictReader",
    "loadtxt",
    "genfromtxt",
    "fromstring",
    "fromtxt",
    "ParquetFile",
    "loadmat",
    "read_csv",
}


def test_nothing_else_reads_tables() -> None:
    found = {
        (path.relative_to(ROOT).as_posix(), name)
        for path in files_of(*PACKAGES)
        if "tables" not in path.parts
        for name in _names(ast.parse(path.read_text(encoding="utf-8")))
        if name in READERS or name.rpartition(".")[2] in READERS
    }
    assert found == set()


def _names(tree: ast.AST) -> Iterator[str]:
    """What a program uses, with dots, and what it takes from csv."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute | ast.Name):
            yield ast.unparse(node)
        elif isinstance(node, ast.ImportFrom) and node.module == "csv":
            yield from (f"csv.{one.name}" for one in node.names)
