"""The examples of ``examples/`` on other libraries are short (``tests/weekly`` runs them); and the hundred odd rigs."""

from __future__ import annotations

from pathlib import Path

import pytest

from studies.fuzz import odd_rigs

ROOT = Path(__file__).resolve().parent.parent.parent

EXAMPLES = ("sb3_ppo", "cleanrl_ppo", "torchrl_ppo", "rllib_ppo")


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_short(name):
    assert len((ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 60


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(900, 908))
def test_an_odd_rig_works_or_is_refused_in_a_line(seed, tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(odd_rigs.written(seed), encoding="utf-8")
    verdicts = {command: odd_rigs.attempt(command, path, tmp_path) for command in odd_rigs.COMMANDS}
    assert {command: words for command, (verdict, words) in verdicts.items() if verdict == "BAD"} == {}
