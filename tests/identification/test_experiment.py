"""The proposed experiment stays within the workspace, reads back as written, and runs without touching an end stop."""

import re
from pathlib import Path

import numpy as np
import pytest

from baselines.identification import experiment
from baselines.identification.experiment import NAMES, TRAVEL, propose, read_plan
from baselines.identification.laboratory import run_plan
from baselines.registry import make_controller
from birthsim_env.physics.geometry import inverse_geometry
from birthsim_env.physics.rig.parameters import Parameters
from tests.identification.trials import OWNER, TRUE, trial


@pytest.mark.parametrize("rig", [OWNER, OWNER.replace({"cylinder1.stroke": 0.15, "cylinder2.stroke": 0.3})])
def test_it_takes_most_of_both_strokes_and_rests_at_both_ends(rig: Parameters) -> None:
    plan = propose(rig, 12.0, 0)
    piston = inverse_geometry(plan.target, rig)
    half = 0.5 * np.array([rig.cylinder1.stroke, rig.cylinder2.stroke])
    reach = np.abs(piston).max(axis=1) / half
    assert (reach <= TRAVEL + 1e-9).all()
    assert (reach > 0.9 * TRAVEL).all()
    assert np.abs(plan.added).max() <= experiment.STEP
    still = (plan.times < experiment.RISE) | (plan.times > plan.times[-1] - experiment.RISE)
    assert (plan.added[:, still] == 0).all()
    speed = np.diff(plan.target[:, [0, 1, -2, -1]], axis=1)[:, [0, 2]]
    # The ramp is 10 u^3 = 1e-5 at its first row, of 0.2 m at most.
    assert np.abs(speed).max() < 2e-6
    assert (np.std(plan.added[:, ~still], axis=1) > 0.1).all()


def test_a_plan_comes_back_as_it_was_written(tmp_path: Path) -> None:
    plan = propose(OWNER, 5.0, 4)
    plan.write(tmp_path / "plan.csv")
    again = read_plan(tmp_path / "plan.csv", OWNER)
    for one, other in ((plan.times, again.times), (plan.target, again.target), (plan.added, again.added)):
        assert np.allclose(one, other, rtol=1e-8, atol=1e-12)  # nine digits are written


BAD = [
    ("time,x,y\n0,0.5,0\n", "has no column 'added_P1'; there are: time, x, y"),
    ("", "is empty"),
    (f"{','.join(NAMES)}\n0,0.5,zero,0,0,0,0\n", "line 2: '0,0.5,zero,0,0,0,0'; allowed: 7 numbers"),
    (f"{','.join(NAMES)}\n" + "".join(f"{k % 4},0.5,0,0,0,0,0\n" for k in range(9)), "at least 8 rows of finite numbers"),
    (f"{','.join(NAMES)}\n" + "".join(f"{k},0.5,0,2,0,0,0\n" for k in range(9)), "an added opening of 2; allowed: -1 to 1"),
    (f"{','.join(NAMES)}\n" + "".join(f"{k},1.5,0,0,0,0,0\n" for k in range(9)), "position = (1.5, 0) m is unreachable"),
    (f"{','.join(NAMES)}\n" + "".join(f"{0.1 * k:g},0.5,0,0,0,0,0\n" for k in range(9)), "lasts 0.8 s; allowed: 4 to 600 s"),
]


@pytest.mark.parametrize(("text", "words"), BAD)
def test_what_is_wrong_with_a_plan_is_named(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "plan.csv").write_text(text)
    with pytest.raises(ValueError, match=re.escape(words)) as error:
        read_plan(tmp_path / "plan.csv", OWNER)
    assert "\n" not in str(error.value)


def test_a_lane_of_many_is_the_single_rig() -> None:
    plan = propose(OWNER, 4.0, 3)
    both = run_plan(plan, [OWNER, TRUE], make_controller("backstepping", OWNER), "lab", 10)
    for name in ("openings", "pressures", "positions"):
        assert getattr(both[1], name).tobytes() == getattr(trial(), name).tobytes(), name


def test_an_end_stop_is_named() -> None:
    plan = propose(OWNER, 4.0, 3)
    with pytest.raises(ValueError, match="a piston of rig 0 hits its end stop after"):
        run_plan(plan, [OWNER], make_controller("slammed-valves", OWNER), "lab", 0)
