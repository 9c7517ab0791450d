"""birthsim study haptics: files, tables and figures, and what is refused."""

import numpy as np
import pytest

from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.haptics import backdriving, coupled, rendering
from lab.studies.haptics.coupled import measure_hands, measure_z_width, stable_up_to
from lab.studies.haptics.kept import kept, phase
from lab.studies.haptics.tables import backdriving_table, release_table
from lab.studies.stability import maps as stability
from tests.console import OWN, call, strict

SETTINGS = {
    "controller": "admittance-backstepping", "source": "", "rig": Parameters().to_dict(), "sensors": "ideal", "seed": 3,
    "rigs": 2, "force_sensor": True,
}  # fmt: skip


@pytest.fixture
def short(monkeypatch):
    """Few hands, a push at once, and a run of 0.15 s."""
    for name, value in (("PUSHED", 0.0), ("RELEASED", 0.05), ("JUDGED", 0.1), ("END", 0.15)):
        monkeypatch.setattr(stability, name, value)
    few = {"STIFFNESSES": (0.0, 3000.0), "MASSES": (0.0, 1.0, 2.0), "ASKED": (500.0, 2000.0), "FACTORS": (1.0, 2.0, 3.0)}
    for name, value in {**few, "HANDS": ((0.0, 0.0), (2000.0, 1.0))}.items():
        monkeypatch.setattr(coupled, name, value)


@pytest.mark.usefixtures("short")
def test_a_map_of_hands_has_the_worst_rig():
    """Rows over masses, columns over stiffnesses; two rigs are as bad as the worse of each alone."""
    both = measure_hands(0.0, **SETTINGS)
    alone = [measure_hands(0.0, **{**SETTINGS, "seed": seed, "rigs": 1}) for seed in (3, 4)]
    assert np.shape(both["motion_mm"]) == (3, 2)
    worst = np.max([one["motion_mm"] for one in alone], axis=0)
    np.testing.assert_allclose(both["motion_mm"], worst, rtol=1e-9)
    assert both["stable"] == np.all([one["stable"] for one in alone], axis=0).tolist()


@pytest.mark.usefixtures("short")
def test_z_width_says_what_is_refused(monkeypatch):
    """Rows over damping where it can be asked for, else one; setpoints without gains are refused in the law's words."""
    found = measure_z_width(**SETTINGS)
    assert found["factors"] == [1.0, 2.0, 3.0]
    assert np.shape(found["stable"]) == (3, 2)
    assert found["refused"] == [[None, None]] * 3
    soft = measure_z_width(**{**SETTINGS, "controller": "backstepping-cartesian"})
    assert soft["factors"] == [1.0]
    # The paper's law takes 9000 N/m with exact and 7200 N/m with sampled positions (docs/limits.md).
    monkeypatch.setattr(coupled, "ASKED", (7000.0, 8000.0))
    settings = {**SETTINGS, "controller": "backstepping"}
    assert measure_z_width(**settings)["refused"][0] == [None, None]
    accepted, refused = measure_z_width(**{**settings, "sensors": "lab"})["refused"][0]
    assert accepted is None
    assert "allowed: at most 7200 N/m" in refused


def test_stable_up_to_the_first_that_is_not():
    """From the softest that is not refused; nothing after the first miss counts."""
    piece = {
        "stable": [[None, True, True, False, True, None, None, None], [False] + [True] * 7],
        "refused": [["too soft", *[None] * 4, "no", "no", "no"], [None] * 8],
    }
    assert stable_up_to(piece) == [coupled.ASKED[2], 0.0]


def test_tables_say_lost_and_refused():
    run = {"controller": "pid", "sensors": "lab", "uses_force": False}
    pieces = [
        {"stiffness": 500.0, "refused": None, "mean": [1.0, 2.0, None], "most": [3.0, 4.0, None], "lost": [False, False, True]},
        {"stiffness": 0.0, "refused": "stiffness setpoint ..."},
    ]
    table = backdriving_table([{**run, "backdriving": pieces}])
    assert (
        "| controller | rig | mass learned | force sensed | sensors "
        "| at 500 N/m: median of the means | at 500 N/m: largest | at 0 N/m: median of the means |" in table
    )
    assert "| `pid` | default | no | no | lab | 2.00 | lost | refused | refused |" in table
    piece = {"lost": [False], "overshoot_mm": [5.0], "speed": [1.5], "kinetic": [3.0], "energy": [0.0], "stored": 4.5}
    first, second = release_table([{**run, "release": [{**piece, "ideal": None}]}]).split("\n\n")[1:]
    assert first.endswith("\n| `pid` | default | no | no | lab | 5.00 | 5.00 | - | - | 1.50 | 1.50 | - | - |")
    assert second.endswith("\n| `pid` | default | no | no | lab | 3.00 | 3.00 | 4.50 | 0 | 0 | 0 |")


def test_the_phase_is_shown_near_the_declared_one():
    felt, declared = np.exp(1j * np.radians([[190.0]])), np.exp(1j * np.radians([[174.0]]))
    np.testing.assert_allclose(phase(felt, declared), 190.0)


def test_a_result_keeps_quantiles_of_lanes_that_are_not_lost():
    """Three lanes of 10 N, of which one is lost, and one of 20 N: a spring of 1 and of 3 N/m, two frequencies."""
    springs, lines = np.array([1.0, 3.0, np.nan, 50.0]), [0.2, 1.0]
    piece = {
        "stiffness": 2000.0, "frequency": lines, "peak": [10.0, 10.0, 10.0, 20.0], "lost": [False, False, True, False],
        "felt": [[springs, springs], np.zeros((2, 4))], "declared": [[np.full(4, 2.0)] * 2, np.zeros((2, 4))],
        "port_damping": [springs, 2 * springs], "shortage": [[0.0, 1.0, None, 2.0], [1.0, 0.0, None, 3.0]],
        "differences": [springs, 1 / springs], "energy_over_time": [[0.5], [1.5], [2.5]], "energy_period": 0.1,
        "bandwidth": [1 / 3, 2.0, 0.0, 4.0],
    }  # fmt: skip
    softer = {**piece, "stiffness": 1000.0}
    first, found = kept({"controller": "mine", "impedance": [softer, piece]})["impedance"]
    assert "curves" not in first
    assert found["curves"] == {
        "frequency": lines,
        "magnitude": [[1.5] * 2, [2.0] * 2, [2.5] * 2],
        "phase": [[0.0] * 2] * 3,
        "declared": {"magnitude": [2.0] * 2, "phase": [0.0] * 2},
        "damping": [[2.0, 4.0], [1.0, 2.0]],
        "energy": [1.5],
        "energy_period": 0.1,
    }
    assert (found["shortage"], found["noticed"]) == ([1.0, 1.0, None, 3.0], [1.0, 0.333333, None, 0.02])
    assert found["bandwidth"] == [0.333333, 2.0, 0.0, 4.0]
    pull = {"lost": [False] * 3, "time": [0.0], "offset_mm": [[1.0], [2.0], [6.0]], "ideal": None, "given_back": [0.0] * 3}
    (let_go,) = kept({"release": [pull]})["release"]
    assert let_go == {
        "lost": [False] * 3,
        "ideal": None,
        "curves": {"time": [0.0], "offset_mm": [[2.0], [1.0], [6.0]], "declared": None},
    }
    nobody = kept({"impedance": [{**piece, "lost": [True] * 4}]})["impedance"][0]["curves"]
    assert nobody["magnitude"] == [[None] * 2] * 3


@pytest.mark.slow
@pytest.mark.weekly
def test_the_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(rendering, "STIFFNESSES", (2000.0,))
    monkeypatch.setattr(backdriving, "STIFFNESSES", (500.0, 0.0))
    own = tmp_path / "own.py"
    own.write_text(OWN)
    out = tmp_path / "out"
    options = ("--controller", "admittance-backstepping", f"{own}:Held", "--sensors", "ideal", "--nominal")
    status, printed, _ = call("haptics", monkeypatch, capsys, *options, "--out", out)
    assert status == 0
    best, still = strict(out / "haptics.json")["figures"]
    assert best["uses_force"]
    assert not still["uses_force"]
    (middle,) = best["impedance"]
    assert middle["stiffness"] == 2000.0
    assert np.median(np.array(middle["bandwidth"])[np.array(middle["peak"]) == 10.0]) > 3.0
    assert still["impedance"][0]["curves"]["declared"] is None
    assert still["backdriving"][-1]["refused"] is None
    assert best["backdriving"][-1]["refused"].startswith("stiffness setpoint")
    for name in ("haptics_impedance", "haptics_energy", "haptics_release", "stability_hand_mass_held_ideal", "haptics_z_width"):
        assert (out / f"{name}.png").stat().st_size > 20_000
    for subject in ("impedance", "energy", "release", "backdriving", "stability"):
        assert (out / f"haptics-{subject}.md").read_text() in printed
