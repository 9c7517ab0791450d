"""Every registered reader of tables: its ending is known, and what it cannot read is refused plainly."""

import sys
from pathlib import Path

import pytest

from birthsim_env.registry import entries
from birthsim_env.tables.columns import table_file
from birthsim_env.tables.reading import read_table

every_reader = pytest.mark.parametrize("reader", entries("reader"), ids=lambda one: one.name)
DAMAGED = {"nothing": b"", "zeros": bytes(4096), "noise": bytes(range(256)) * 16, "a word": b"neither\n"}
IMPORTED = {"extra log": ("pyarrow", "mcap.records")}
"""What readers import of an extra."""


@every_reader
def test_an_ending_is_known_in_any_case(reader):
    assert reader.name == reader.name.lower()
    assert reader.name.startswith(".")
    for ending in (reader.name, reader.name.upper()):
        assert table_file(f"a{ending}:x,y") == (Path(f"a{ending}"), "x,y")


@every_reader
@pytest.mark.parametrize("kind", DAMAGED)
def test_a_damaged_file_is_refused_in_a_line_that_names_it(reader, kind, tmp_path):
    path = tmp_path / f"own{reader.name}"
    path.write_bytes(DAMAGED[kind])
    with pytest.raises(ValueError, match="log = ") as caught:
        read_table("log", path).column("time")
    assert path.name in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("reader", [one for one in entries("reader") if one.needs], ids=lambda one: one.name)
def test_a_reader_whose_extra_is_missing_names_it(reader, tmp_path, monkeypatch):
    for module in list(sys.modules):
        if module.startswith(("birthsim_env.tables.parquet", "birthsim_env.tables.mcap")):
            monkeypatch.delitem(sys.modules, module)
    for need in reader.needs:
        for module in IMPORTED[need]:
            monkeypatch.setitem(sys.modules, module, None)
    path = tmp_path / f"own{reader.name}"
    path.write_bytes(b"whatever")
    with pytest.raises(ValueError, match=r"log = .*; allowed with the extra: .*\[log\]"):
        read_table("log", path)


def test_an_unknown_ending_is_refused_with_those_that_there_are(tmp_path):
    with pytest.raises(ValueError, match=r"table = .*allowed: a file that ends in") as caught:
        read_table("table", tmp_path / "own.docx")
    assert [one.name for one in entries("reader") if one.name not in str(caught.value)] == []
