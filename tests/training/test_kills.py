"""Trainings that die: they go on, and end with the policy and the curve of one that never did."""

import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise

import gymnasium
import pytest

from agents.policy.files import WEIGHTS, load_policy
from agents.residual.settings import ResidualSettings
from agents.training import monitor, reached
from agents.training import trainer as training
from agents.training.checkpoint import NAME, save_checkpoint
from agents.training.trainer import train
from tests.console import PATIENCE, ROOT, run, strict
from tests.training.brief import TINY, steady

RESIDUAL = ResidualSettings("backstepping-force-first", "variable_kp")


@pytest.fixture
def brief(monkeypatch):
    """Episodes of 1.2 seconds: some are settled, some end within a training."""
    make_vec = gymnasium.make_vec
    monkeypatch.setattr(training.gymnasium, "make_vec", lambda *args, **more: make_vec(*args, **{"duration": 1.2, **more}))


class Killed(Exception):
    """Nobody catches it."""


def killed(monkeypatch, settings, folder, method, count):
    """Train until a method of the monitor is entered for the ``count``-th time; the steps that are done by then."""
    calls, own = [], getattr(monitor.Monitor, method)

    def die(self, *args):
        calls.append(self.num_timesteps)
        if len(calls) == count:
            raise Killed
        return own(self, *args)

    with monkeypatch.context() as patch:
        patch.setattr(monitor.Monitor, method, die)
        with pytest.raises(Killed):
            train(settings, RESIDUAL, folder)
    return calls[-1]


STEP, CHECK, ROLLOUT = "_on_step", "_check", "_on_rollout_start"


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    ("changes", "places"),
    [
        pytest.param({}, [(STEP, 1), (STEP, 70), (STEP, 127), (CHECK, 2), (CHECK, 5), (ROLLOUT, 5)], marks=SLOW, id="ppo"),
        pytest.param({}, [(STEP, 70), (CHECK, 5)], id="ppo, two deaths"),
        pytest.param({"sensors": "lab", "environment": "BirthSIM/CircleResidual-v1"}, [(CHECK, 5)], marks=SLOW, id="ppo lab"),
        # The first 160 steps are drawn from the space of actions.
        pytest.param({"algorithm": "sac", "steps": 384}, [(STEP, 10), (STEP, 40), (CHECK, 4)], marks=SLOW, id="sac"),
        pytest.param({"algorithm": "tqc", "steps": 256}, [(STEP, 30)], marks=SLOW, id="tqc"),
    ],
)
@pytest.mark.usefixtures("brief")
def test_wherever_it_dies_it_ends_with_the_policy_of_one_that_did_not(tmp_path, monkeypatch, capsys, changes, places):
    settings = replace(TINY, **changes)
    expected = train(settings, RESIDUAL, tmp_path / "whole")
    policy = (tmp_path / "whole" / WEIGHTS).read_bytes()
    for k, (method, count) in enumerate(places):
        folder = tmp_path / str(k)
        killed(monkeypatch, settings, folder, method, count)
        capsys.readouterr()
        reached = train(settings, RESIDUAL, folder)
        assert "steps are there and are kept" in capsys.readouterr().out
        assert (folder / WEIGHTS).read_bytes() == policy
        assert steady(reached["curve"]) == steady(expected["curve"])
        assert steady([reached["law"], reached["policy"]]) == steady([expected["law"], expected["policy"]])
        assert all(later["seconds"] > sooner["seconds"] for sooner, later in pairwise(reached["curve"]))


@pytest.mark.slow
@pytest.mark.usefixtures("brief")
@pytest.mark.parametrize(("module", "name"), [(monitor, "save_checkpoint"), (reached, "save_policy")])
def test_a_death_between_the_two_files_loses_no_policy(tmp_path, monkeypatch, module, name):
    """The checkpoint holds the best policy: whichever file is the newer one, the training ends as it would have."""
    expected, saves = train(TINY, RESIDUAL, tmp_path / "whole"), []
    own = getattr(module, name)

    def dies(*args):
        saves.append(own(*args))
        if len(saves) == 2:
            raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(module, name, dies)
        with pytest.raises(Killed):
            train(TINY, RESIDUAL, tmp_path / "cut")
    (tmp_path / "cut" / WEIGHTS).unlink()
    reached = train(TINY, RESIDUAL, tmp_path / "cut")
    assert steady(reached["curve"]) == steady(expected["curve"])
    assert (tmp_path / "cut" / WEIGHTS).read_bytes() == (tmp_path / "whole" / WEIGHTS).read_bytes()


@pytest.mark.usefixtures("brief")
def test_an_interrupt_between_the_two_files_writes_the_policy_as_well(tmp_path, monkeypatch, capsys):
    def interrupted(*args):
        save_checkpoint(*args)
        raise KeyboardInterrupt

    monkeypatch.setattr(monitor, "save_checkpoint", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(TINY, RESIDUAL, tmp_path)
    assert "interrupted after 0 steps: policy and checkpoint are kept in " in capsys.readouterr().out
    assert load_policy(tmp_path).settings == RESIDUAL


CONFIGURATION = """[training]
environment = "BirthSIM/ProbeResidual-v2"
steps = 4096
lanes = 8
rollout = 32
batch = 64
epochs = 1
hidden = [8, 8]
validation_lanes = 2
validations = 8
"""


@pytest.mark.slow
def test_a_process_that_is_killed_ends_with_the_same_policy(tmp_path):
    """SIGKILL, which no handler sees, at any moment after some checkpoint; then the same command again."""
    (tmp_path / "tiny.toml").write_text(CONFIGURATION)
    done = run("train", "--config", tmp_path / "tiny.toml", "--out", tmp_path / "whole")
    assert done.returncode == 0, done.stderr
    options = ("--config", tmp_path / "tiny.toml", "--out", tmp_path / "out")
    line, path = [sys.executable, "-m", "birthsim", "train", *map(str, options)], tmp_path / "out" / "seed_0" / NAME
    for _ in range(3):
        before = path.read_bytes() if path.is_file() else b""
        with subprocess.Popen(line, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            try:
                until = time.monotonic() + PATIENCE
                while process.poll() is None and time.monotonic() < until:
                    if path.is_file() and path.read_bytes() != before:
                        break
                    time.sleep(0.01)
            finally:
                process.kill()
        assert process.returncode == -signal.SIGKILL
    done = run("train", *options)
    assert done.returncode == 0, done.stderr
    assert "of 4,096 steps are there and are kept" in done.stdout
    cut, whole = (tmp_path / place / "seed_0" for place in ("out", "whole"))
    assert (cut / WEIGHTS).read_bytes() == (whole / WEIGHTS).read_bytes()
    assert steady(strict(cut / "training.json")["curve"]) == steady(strict(whole / "training.json")["curve"])
