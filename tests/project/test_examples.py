"""The examples of ``examples/`` on other libraries are short (``studies/clients`` runs them)."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent

EXAMPLES = ("sb3_ppo", "cleanrl_ppo", "torchrl_ppo", "rllib_ppo")


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_short(name):
    assert len((ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 60
