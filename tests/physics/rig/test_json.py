"""The reader of JSON: what is no JSON, too deep, too large, said twice or of another kind is refused in one short line."""

import json
import re

import pytest

from birthsim_env.physics.compiled.sources import files_of
from birthsim_env.physics.rig.json_reading import DEEPEST, DIGITS, parse_json, read_json
from birthsim_env.physics.rig.schema import Each, Listed, fault
from tests.console import ROOT

DAMAGED = {
    "nothing": b"", "half": b'{"a": [1', "more": b"{} {}", "no text": b'{"a": "\xff"}' + b"\xff" * 90_000,
    "half a character": b'"\\ud800"',
    "lists": b"[" * 100_000, "objects": b'{"a":' * 100_000, "closed": b"[" * 500 + b"]" * 500,
    "one too deep": b"[" * (DEEPEST + 1) + b"]" * (DEEPEST + 1), "digits": b"1" + b"0" * DIGITS, "many digits": b"9" * 100_000,
    "a large number": b"1e999", "not a number": b"NaN", "infinity": b"[-Infinity]", "twice": b'{"a": 1, "b": 2, "a": 3}',
    "a long name twice": b'{"%s": 1, "%s": 2}' % (b"x" * 90_000, b"x" * 90_000), "TOML": b"a = 1",
}  # fmt: skip


@pytest.mark.parametrize("content", DAMAGED.values(), ids=DAMAGED)
def test_what_is_no_json_is_refused_in_one_short_line(content, tmp_path):
    (tmp_path / "own.json").write_bytes(content)
    with pytest.raises(ValueError, match=r"^start = .*own\.json' is damaged: .*; allowed: JSON$") as refused:
        read_json("start", tmp_path / "own.json")
    assert len(str(refused.value)) < 600
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("path", ["gone.json", "", ".", "x\0y", "x" * 9000], ids=range(5))
def test_a_file_that_cannot_be_read_is_named(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=r"^start = .* cannot be read: .*; allowed: a file"):
        read_json("start", path)


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    (tmp_path / "own.json").write_text("[" + "1," * 5000 + "1]")
    with pytest.raises(ValueError, match=r"^start = .*own\.json' is larger than allowed: at most 5000 bytes"):
        read_json("start", tmp_path / "own.json", most=5000)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_every_encoding_of_json_is_read(encoding):
    said = {"häma": [1, 2.5, None, True, "ö", {"x": 10 ** (DIGITS - 1)}]}
    assert parse_json("said", json.dumps(said, ensure_ascii=False).encode(encoding)) == said


def test_what_is_just_within_the_limits_is_read():
    assert parse_json("said", "[" * DEEPEST + "]" * DEEPEST)
    assert float(parse_json("said", "9" * DIGITS)) < float("inf")
    assert parse_json("said", "[NaN, 1e999]", finite=False)[1] == float("inf")


SCHEMA = {
    "word": str, "count": range(1, 4), "flag": bool, "size": (float, None), "more?": {"inner": int},
    "each": Each(Listed(float, 1)), "any": object,
}  # fmt: skip
GOOD = {"word": "a", "count": 3, "flag": True, "size": None, "each": {"b": [1, 2.5]}, "any": [], "unknown": 1}


def test_what_fits_a_schema_has_no_fault():
    for change in ({}, {"size": 1}, {"size": 1.5}, {"more": {"inner": 1}}, {"each": {}}, {"any": None}, {"any": True}):
        assert fault({**GOOD, **change}, SCHEMA) == ""


@pytest.mark.parametrize(
    ("change", "place", "allowed"),
    [
        ({"word": 1}, ".word = 1", "text"),
        ({"word": None}, ".word = None", "text"),
        ({"count": 4}, ".count = 4", "1 to 3"),
        ({"count": True}, ".count = True", "1 to 3"),
        ({"count": 2.0}, ".count = 2.0", "1 to 3"),
        ({"flag": 1}, ".flag = 1", "true or false"),
        ({"size": True}, ".size = True", "a number or null"),
        ({"size": "nan"}, ".size = 'nan'", "a number or null"),
        ({"more": {}}, ".more lacks 'inner'", "inner"),
        ({"more": []}, ".more = []", "an object with inner"),
        ({"each": {"b": []}}, ".each.'b' = []", "a list of at least 1"),
        ({"each": {"b": [1, None]}}, ".each.'b'[1] = None", "a number"),
        ({"each": [1]}, ".each = [1]", "an object"),
        ({"word": "x" * 90_000 + "\n"}, "", ""),
    ],
)
def test_what_does_not_fit_is_named_with_its_place_and_what_is_allowed(change, place, allowed):
    said = fault({**GOOD, **change}, SCHEMA, "here")
    assert said.startswith(f"here{place}" if place else "")
    assert said.endswith(allowed)
    assert len(said) < 600


def test_what_lacks_a_part_and_what_is_no_object_is_named():
    assert fault({}, SCHEMA) == "content lacks 'word'; allowed: an object with word, count, flag, size, each, any"
    assert fault([1], SCHEMA).startswith("content = [1]; allowed: an object with word")


OWN = {
    "birthsim_build/code/emit.py": "its parent's words", "agents/training/checkpoint.py": "what it has just written",
    "birthsim_drive/session.py": "what its processes wrote in this drive: what was left before is removed",
    "birthsim_env/physics/compiled/sources.py": "under a SHA-256",
    "birthsim_env/physics/compiled/prebuilt.py": "what make kernels wrote, and what is damaged counts as missing",
    **{f"birthsim_build/kernels/{name}.py": "what make kernels wrote" for name in ("__main__", "freshness", "recording")},
}  # fmt: skip
"""Files that parse JSON which the package itself has just written, and why nobody else can have."""


def test_nothing_else_in_the_packages_parses_json():
    packages = ("birthsim", "birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_drive", "birthsim_live")
    files = files_of(*packages)
    found = {path.relative_to(ROOT).as_posix() for path in files if re.search(r"\bjson\.loads?\(", path.read_text("utf-8"))}
    assert found == {*OWN, "birthsim_env/physics/rig/json_reading.py"}
