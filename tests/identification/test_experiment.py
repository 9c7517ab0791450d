"""The proposed experiment stays within the workspace, reads back as written, and runs without touching an end stop."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from baselines.identification import experiment
from baselines.identification.experiment import TRAVEL, propose, read_plan, suited
from baselines.identification.laboratory import run_plan
from baselines.named import make_controller
from birthsim_env.physics.linkage.geometry import inverse_geometry
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


def test_a_plan_in_mm_is_refused_by_its_name(tmp_path: Path) -> None:
    plan = propose(OWNER, 5.0, 4)
    replace(plan, target=1e3 * plan.target).write(tmp_path / "plan.csv")
    with pytest.raises(ValueError, match=r"^plan = '.*plan.csv': positions\[0, 0\] = 500; allowed: -10 to 10"):
        read_plan(tmp_path / "plan.csv", OWNER)


def test_a_lane_of_many_is_the_single_rig() -> None:
    plan = propose(OWNER, 4.0, 3)
    both = run_plan(plan, [OWNER, TRUE], make_controller("backstepping", OWNER), "lab", 10)
    for name in ("openings", "pressures", "positions"):
        assert getattr(both[1], name).tobytes() == getattr(trial(), name).tobytes(), name


def test_an_end_stop_is_named() -> None:
    plan = propose(OWNER, 4.0, 3)
    with pytest.raises(ValueError, match="a piston of rig 0 hits its end stop after"):
        run_plan(plan, [OWNER], make_controller("slammed-valves", OWNER), "lab", 0)


def test_on_the_default_rig_the_suited_plan_is_the_plan() -> None:
    plan = propose(Parameters(), 4.0, 3)
    np.testing.assert_array_equal(suited(plan, Parameters()).asked(), plan.asked())


def test_a_long_wide_cylinder_keeps_its_chambers_filled() -> None:
    """Soft for a short narrow one is empty for it, and from empty chambers no valve is identified."""
    bench = {"linkage": {"kind": "rail"}, "cylinder2": {"piston_diameter": 0.032, "rod_diameter": 0.012, "stroke": 0.3}}
    rig = Parameters.from_dict(bench)
    plan, law = propose(rig, 4.0, 3), make_controller("backstepping", rig)
    least, kept = (run_plan(one, [rig], law, "encoders", 0)[0].pressures[2:] for one in (plan, suited(plan, rig)))
    atmosphere = rig.air.atmospheric_pressure
    assert np.quantile(least, 0.05) < 1.2 * atmosphere
    assert np.quantile(kept, 0.05) > 1.5 * atmosphere
