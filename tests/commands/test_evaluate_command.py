"""birthsim evaluate: tables, strict JSON and figures, a controller from a file, the comparison by pieces, and Ctrl-C."""

import math
import os
import re
from functools import partial

import pytest

from baselines import evaluate, make_controller
from birthsim_env import Parameters
from birthsim_env.files import finite
from lab.studies.comparison import stiffness as studies
from lab.studies.comparison.study import cells_of
from tests.console import OWN, assert_picture, call, interrupted, strict


@pytest.mark.usefixtures("brief")
def test_for_a_paper_its_figure_is_a_pdf(tmp_path, monkeypatch, capsys):
    arguments = ("--env", "BirthSIM/Probe-v3", "--episodes", "1", "--controller", "backstepping", "--jobs", 1)
    status, printed, complained = call("evaluate", monkeypatch, capsys, *arguments, "--style", "paper", "--out", tmp_path)
    assert status == 0, complained
    assert [path.name for path in tmp_path.iterdir() if path.stem == "error_over_time"] == ["error_over_time.pdf"]
    assert "error_over_time.pdf" in printed


@pytest.mark.usefixtures("brief")
def test_evaluate_writes_a_table_json_and_a_figure(tmp_path, monkeypatch, capsys):
    out = tmp_path / "new" / "folder"
    controllers = ("--controller", "backstepping", "backstepping-weight")
    arguments = ("--env", "BirthSIM/Probe-v3", "--episodes", "3", "--seed", "7", *controllers, "--jobs", 1)
    status, printed, complained = call("evaluate", monkeypatch, capsys, *arguments, "--out", out)
    assert status == 0, complained
    files = {f"error_over_time.{kind}" for kind in ("png", "svg")} | {f"evaluation.{kind}" for kind in ("csv", "json", "md")}
    assert {path.name for path in out.iterdir()} == files | {".lock", "pieces", "times.json"}
    table = (out / "evaluation.md").read_text()
    assert table.startswith("BirthSIM/Probe-v3, 3 episodes from seed 7, ideal sensors, --randomize all")
    assert table.splitlines()[0] in printed
    figures = (out / "evaluation.csv").read_text().splitlines()
    assert "lost episodes,of 3,backstepping-weight,0,," in figures
    content = strict(out / "evaluation.json")
    assert content["arguments"]["env"] == "BirthSIM/Probe-v3"
    for name, result in zip(("backstepping", "backstepping-weight"), content["results"], strict=True):
        law = make_controller(name, Parameters())
        alone = evaluate("BirthSIM/Probe-v3", law, name, 3, 7, progress=False, randomize=True).to_dict()
        assert (result["controller"], result["seeds"]) == (name, [7, 8, 9])
        assert result["episodes"] == finite(alone["episodes"])
        median, largest = (f"{result['summary']['settled_rms'][which]:.3g}" for which in ("median", "max"))
        assert re.search(rf"\n{name} +{median} .* {largest} +0 of 3\n", printed), "the short table"
        assert re.search(rf"\nsettled_rms,mm,{name},{median},.*,{largest}\n", "\n".join(figures))
        assert re.search(rf"\n\| settled_rms \| .* {median} \| .* \| {largest} \|", table)
    assert_picture(out, "error_over_time")


def test_evaluate_takes_a_rig_and_a_controller_from_files_and_survives_the_loss_of_every_episode(tmp_path, monkeypatch, capsys):
    (tmp_path / "slam.py").write_text(OWN)
    (tmp_path / "rig.toml").write_text("[mechanics]\nmass = 3.5\n")
    world = ("--env", "BirthSIM/Probe-v3", "--randomize", "none", "--sensors", "lab", "--parameters", tmp_path / "rig.toml")
    arguments = ("--episodes", 2, "--controller", f"{tmp_path}/slam.py:Slam", "--out", tmp_path / "out")
    status, printed, complained = call("evaluate", monkeypatch, capsys, *world, *arguments)
    assert status == 0, complained
    assert "BirthSIM/Probe-v3, 2 episodes from seed 0, lab sensors, --randomize none" in printed
    assert "Warning" not in complained
    assert "| lost episodes |  | 2 of 2 |" in (tmp_path / "out" / "evaluation.md").read_text()
    assert re.search(r"Slam .* 2 of 2\n", printed)
    content = strict(tmp_path / "out" / "evaluation.json")
    assert content["rig"]["mechanics"]["mass"] == 3.5
    (result,) = content["results"]
    assert result["lost"] == [True, True]
    assert result["episodes"]["stiffness_error"] == result["episodes"]["cross_motion"] == [None, None]
    assert_picture(tmp_path / "out", "error_over_time")


FAILING = """

class Fails(Slam):
    def command(self, measurement, reference):
        raise RuntimeError("no law at all")
"""


@pytest.mark.slow
def test_the_comparison_compares_and_draws(tmp_path, monkeypatch, capsys):
    (tmp_path / "slam.py").write_text(OWN)
    slam, out = f"{tmp_path}/slam.py:Slam", tmp_path / "out"
    world = ("--env", "BirthSIM/Probe-v3", "--sensors", "ideal", "--episodes", 2, "--plant", "nominal", "randomised")
    arguments = (*world, "--controller", "backstepping", slam, "--jobs", 1, "--out", out)
    status, printed, complained = call("comparison", monkeypatch, capsys, *arguments)
    assert status == 0, complained
    assert "Warning" not in complained
    assert "comparison: 100%" in complained
    assert "4/4 " in complained
    content = strict(out / "comparison.json")
    assert content["settings"]["controller"] == ["backstepping", slam]
    assert "out" not in content["settings"], "results do not depend on where they are"
    cells = {(cell["controller"], cell["plant"]): cell for cell in cells_of(content)}
    assert set(cells) == {(name, plant) for name in ("backstepping", slam) for plant in ("nominal", "randomised")}
    law, lost = cells["backstepping", "nominal"], cells[slam, "nominal"]
    assert (law["episodes"], law["lost"], lost["lost"]) == (2, 0, 2)
    assert 0 < law["metrics"]["stiffness_error"]["median"] < 200
    assert lost["metrics"]["stiffness_error"]["median"] == lost["ratios"]["air"]["low"] == math.inf
    text = (out / "comparison.md").read_text()
    assert text.strip() in printed
    assert f"| `{slam}` | default | no | yes | lost | lost |" in text
    for name in ("settled_error", "air_against_error"):
        assert_picture(out, name)
        assert f"{name}.png" in printed


@pytest.mark.slow
def test_how_the_stiffness_feels_is_kept_and_drawn(tmp_path, monkeypatch, capsys):
    """Studies of one pose, which take a second each instead of ten."""
    pose, small = {"poses": ((0.5, 0.0),)}, {"setpoints": (2000.0,), "forces": (20.0,)}
    for name, options in (("stiffness", small), ("polar", {"directions": 4}), ("ellipses", {})):
        monkeypatch.setitem(studies.STUDIES, name, partial(studies.STUDIES[name], **pose, **options))
    monkeypatch.setattr(studies, "disturbance_study", partial(studies.disturbance_study, amplitudes=(2.0, 20.0), **pose))
    (tmp_path / "slam.py").write_text(OWN)
    slam, out = f"{tmp_path}/slam.py:Slam", tmp_path / "out"
    status, printed, complained = call("stiffness", monkeypatch, capsys, "--controller", "backstepping", slam, "--out", out)
    assert status == 0, complained
    figures = strict(out / "stiffness.json")["figures"]
    assert set(figures) == {"stiffness", "polar", "ellipses", "disturbance"}
    assert set(figures["polar"]) == {"backstepping", slam}
    assert figures["polar"][slam]["stiffness"] == [[None]] * 4
    for name in ("rendered_stiffness", "hunting", "disturbances", "stiffness_by_direction", "stiffness_ellipses"):
        assert_picture(out, name)
        assert f"{name}.png" in printed


@pytest.mark.usefixtures("brief")
def test_the_comparison_keeps_what_others_reached_when_a_controller_fails(tmp_path, monkeypatch, capsys):
    """With drawn sensors, whose case is named in words of its own."""
    (tmp_path / "own.py").write_text(OWN + FAILING)
    fails = f"{tmp_path}/own.py:Fails"
    world = ("--env", "BirthSIM/Probe-v3", "--sensors", "honest", "--episodes", 2, "--plant", "drawn-sensors")
    arguments = (*world, "--jobs", 1, "--controller", fails, "backstepping")
    status, printed, complained = call("comparison", monkeypatch, capsys, *arguments, "--out", tmp_path / "out")
    assert status == 2
    assert "| `backstepping` |" in printed
    assert "birthsim study comparison: error: 1 of 2 pieces failed, the first cells/" in complained
    assert "RuntimeError: no law at all" in complained
    assert 'BirthSIM/Probe-v3,honest,"figures randomised, nominal",' in (tmp_path / "out/comparison.csv").read_text()
    assert [cell["controller"] for cell in cells_of(strict(tmp_path / "out" / "comparison.json"))] == ["backstepping"]


def test_ctrl_c_during_an_evaluation_keeps_the_complete_episodes(tmp_path):
    own, out = tmp_path / "own.py", tmp_path / "out"
    own.write_text(OWN)
    arguments = ("--env", "BirthSIM/Probe-v3", "--controller", f"{own}:Slam", "--episodes", 10**5, "--jobs", 1, "--out", out)
    status, printed = interrupted(
        "evaluate", arguments, lambda: any(name.endswith(".json") for _, _, files in os.walk(out) for name in files)
    )
    kept = list(out.rglob("*.json"))
    assert status == 130
    assert f"episodes: {len(kept)} of 1563 are complete and kept; the same command goes on" in printed
    assert [path for path in out.rglob("*") if path.is_file() and path not in (*kept, out / ".lock")] == [], "no half a file"
