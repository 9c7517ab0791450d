"""Everything that is read or called with odd input: a valid object or a clear error, within limits, without other deeds."""

import json
import os
import signal
import subprocess
import sys
from itertools import repeat

import numpy as np
import pytest

from lab.studies.fuzz import harness, odd_rigs
from lab.studies.fuzz.harness import Case, Kind, fuzz
from lab.studies.fuzz.kinds import KINDS
from lab.studies.fuzz.mutations import nested
from tests.console import ROOT


@pytest.mark.slow
def test_hundreds_of_cases_of_every_kind(tmp_path):
    line = [sys.executable, "-m", "birthsim", "study", "fuzz", "--kind", *KINDS, "--cases", "400", "--seed", "2"]
    line += ["--out", str(tmp_path / "fuzz.json")]
    ended = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout
    figures = json.loads((tmp_path / "fuzz.json").read_text(encoding="utf-8"))["kinds"]
    assert {kind: found["cases"] for kind, found in figures.items()} == dict.fromkeys(KINDS, 400)


def _raise(error):
    raise error


DEEDS = (
    lambda folder: None,
    lambda folder: _raise(ValueError("argument = 3; allowed: less")),
    lambda folder: _raise(ValueError("3; allowed: less")),
    lambda folder: _raise(ValueError("argument = 3 is wrong")),
    lambda folder: _raise(KeyError("argument = 3; allowed: less")),
    lambda folder: os.kill(os.getpid(), signal.SIGSEGV),
    lambda folder: np.ones(2**27),
    lambda folder: sum(1 for _ in repeat(0)),
    lambda folder: os.system("true"),
    lambda folder: (folder.parent.parent / "elsewhere").write_text("x"),
)


def _misbehave(_, rng, folder, case):
    case.names = ("argument",)
    DEEDS[rng.integers(len(DEEDS))](folder)


@pytest.mark.slow
def test_the_harness_sees_every_misbehaviour(monkeypatch):
    monkeypatch.setattr(harness, "SECONDS", 0.5)
    *_, figures = fuzz("misbehaviour", Kind(lambda folder: None, _misbehave), 120, 0)
    found = {signature.partition(": ")[0].partition("elsewhere")[0] for signature, *_ in figures.signatures()}
    assert figures.tried == 120
    assert 0 < figures.valid < 30
    assert 0 < figures.refused < 30
    assert {"names neither argument nor file", "does not say what is allowed", "KeyError", "the process ends with -11"} <= found
    assert {"MemoryError", "TooSlowError", "does os.system"} <= found
    assert any(one.startswith("does writing to") for one in found)


def test_any_value_is_shown_in_a_short_line():
    from birthsim_env.physics.rig.values import LONGEST, shown

    silent = type("Odd", (), {"__repr__": None})()
    for value in (10**320, 16**5000, -(10**320), nested(3000), "x" * 5000, "a\nb", np.zeros((9, 9)), silent):
        text = shown(value)
        assert 0 < len(text) <= LONGEST
        assert "\n" not in text


def test_a_case_is_its_kind_seed_and_number():
    draws = [harness.generator(*key).random() for key in (("a", 0, 1), ("a", 0, 1), ("b", 0, 1), ("a", 1, 1), ("a", 0, 2))]
    assert draws[0] == draws[1]
    assert len(set(draws)) == 4
    assert Case().names == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(900, 908))
def test_an_odd_rig_works_or_is_refused_in_a_line(seed, tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(odd_rigs.written(seed), encoding="utf-8")
    verdicts = {command: odd_rigs.attempt(command, path, tmp_path) for command in odd_rigs.COMMANDS}
    assert {command: words for command, (verdict, words) in verdicts.items() if verdict == "BAD"} == {}
