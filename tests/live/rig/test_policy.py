"""A policy of one's own on the page: ``birthsim live --policy``."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from agents.policy.files import load_policy
from agents.policy.seeds import SHIPPED, best_policy
from birthsim_build.residual import residual_parts
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.session import Session
from birthsim_live.rig.settings import opening_settings
from birthsim_live.static.pack import pack
from tests.console import call

RIG = Parameters()


@pytest.fixture
def mine(tmp_path: Path) -> str:
    """A folder as birthsim train leaves it."""
    return str(shutil.copytree(SHIPPED / "circle" / "seed_0", tmp_path / "run 1" / "seed_0").parent)


def test_it_is_a_choice_and_the_page_opens_with_it(mine: str) -> None:
    session = Session(RIG, opening_settings(RIG, [mine]), policies=[mine, "forceps"])
    choices = {one["name"]: one for one in session.choices.controllers}
    assert session.settings.controller == f"residual:{mine}"
    assert "run 1" in choices[f"residual:{mine}"]["title"]
    assert [name for name in choices if name == "residual:forceps"] == ["residual:forceps"]
    session.advance(200)
    assert session.lost is None
    session.change({"controller": "residual:forceps"})
    session.change({"controller": f"residual:{mine}"})
    session.advance(50)
    shipped = Session(RIG)
    with pytest.raises(ValueError, match=r"controller = .*allowed: backstepping"):
        shipped.change({"controller": f"residual:{mine}"})


def test_the_page_without_a_server_has_it_too(mine: str) -> None:
    packed = pack(RIG, [mine])
    assert packed.content["opens"] == {"controller": f"residual:{mine}"}
    assert packed.content["settings"]["controller"] == "backstepping"
    numbers = packed.content["parts"]["controllers"]
    copied, other = numbers[f"residual:{mine}"], numbers["residual:forceps"]
    assert copied["exact"]["policy"] == copied["sampled"]["policy"]  # kept once
    assert copied["exact"]["policy"] != other["exact"]["policy"]


def test_a_policy_that_remembers_has_a_memory_in_the_page() -> None:
    name = "circle_honest_student"
    policy, _ = residual_parts(RIG, True, name)
    cells = load_policy(best_policy(name)).network.cells
    assert cells > 0
    memory = policy.stages[-1].memory
    assert memory is not None
    np.testing.assert_array_equal(memory[:, 0], np.zeros(1 + cells))
    session = Session(RIG)
    session.change({"controller": f"residual:{name}", "sensors": "honest"})
    session.advance(200)
    assert session.lost is None


@pytest.mark.parametrize("where", [[], ["--static", "page"]])
def test_what_is_no_policy_is_refused_in_one_line(
    where: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    status, _, complained = call("live", monkeypatch, capsys, "--port", "0", "--policy", "circle", "nowhere", *where)
    assert status == 2
    assert complained.strip().splitlines()[-1].startswith("birthsim live: error: policy = 'nowhere'")
    assert not (tmp_path / "page").exists()
