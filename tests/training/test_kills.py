"""Trainings that die: they go on, and end with the policy and the curve of one that never did."""

import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise

import pytest

from agents.policy.files import WEIGHTS, read_policy
from agents.residual.settings import ResidualSettings
from agents.training import policy_gradient, reached
from agents.training.checkpoint import NAME
from agents.training.sb3 import monitor
from agents.training.sb3.checkpoint import save_checkpoint
from agents.training.trainer import train
from tests.console import PATIENCE, ROOT, run, strict
from tests.training.brief import TINY, steady
from tests.training.test_policy_gradient import BESIDE, INFORMED, PURE, SHORT

RESIDUAL = ResidualSettings("backstepping-force-first", "variable_kp")


class Killed(Exception):
    """Nobody catches it."""


def killed(monkeypatch, settings, residual, folder, place, name, count):
    """Train until a method of the monitor is entered, or a file is written, for the ``count``-th time."""
    calls, own = [], getattr(place, name)

    def die(*args):
        calls.append(own(*args) if name.startswith("save") or len(calls) + 1 < count else None)
        if len(calls) == count:
            raise Killed
        return calls[-1]

    with monkeypatch.context() as patch:
        patch.setattr(place, name, die)
        with pytest.raises(Killed):
            train(settings, residual, folder)


STEP, CHECK, ROLLOUT = ((monitor.Monitor, name) for name in ("_on_step", "_check", "_on_rollout_start"))
FILES = [(monitor, "save_checkpoint", 2), (reached, "save_policy", 2)]
SLOW = pytest.mark.slow
UPDATE = (policy_gradient.PolicyGradient, "_update", 60)
"""Some way beyond the validation half way."""
SAC = replace(TINY, algorithm="sac", steps=384)
REMEMBERS = replace(SHORT, memory=5, horizon=4, lanes=16, steps=1024, privileged=True)
RECURRENT = replace(TINY, algorithm="recurrent-ppo", memory=6)
LAB = replace(TINY, sensors="lab", environment="BirthSIM/CircleResidual-v2")


@pytest.mark.parametrize(
    ("settings", "residual", "places"),
    [
        pytest.param(TINY, RESIDUAL, [(*STEP, 1), (*STEP, 127), (*CHECK, 2), (*ROLLOUT, 5), *FILES], marks=SLOW, id="ppo"),
        pytest.param(TINY, RESIDUAL, [(*STEP, 70), (*CHECK, 5)], id="ppo, two deaths"),
        pytest.param(LAB, RESIDUAL, [(*CHECK, 5)], marks=SLOW, id="ppo lab"),
        # The first 160 steps are drawn from the space of actions.
        pytest.param(SAC, RESIDUAL, [(*STEP, 10), (*STEP, 40), (*CHECK, 4)], marks=SLOW, id="sac"),
        pytest.param(replace(TINY, algorithm="tqc", steps=256), RESIDUAL, [(*STEP, 30)], marks=SLOW, id="tqc"),
        pytest.param(RECURRENT, RESIDUAL, [(*STEP, 70), (*CHECK, 5)], id="recurrent ppo, two deaths"),
        pytest.param(SHORT, PURE, [UPDATE], marks=SLOW, id="apg"),
        pytest.param(BESIDE, INFORMED, [UPDATE], marks=pytest.mark.weekly, id="apg, informed"),
        pytest.param(REMEMBERS, PURE, [(*UPDATE[:2], 5)], marks=SLOW, id="apg, with a memory"),
    ],
)
@pytest.mark.usefixtures("short_probe")
def test_wherever_it_dies_it_ends_with_the_policy_of_one_that_did_not(
    tmp_path, monkeypatch, capsys, settings, residual, places
):
    """The checkpoint holds the best policy: whichever file is the newer one, the training ends as it would have."""
    expected = train(settings, residual, tmp_path / "whole")
    policy = (tmp_path / "whole" / WEIGHTS).read_bytes()
    for k, place in enumerate(places):
        folder = tmp_path / str(k)
        killed(monkeypatch, settings, residual, folder, *place)
        (folder / WEIGHTS).unlink(missing_ok=True)
        capsys.readouterr()
        ended = train(settings, residual, folder)
        assert "steps are there and are kept" in capsys.readouterr().out
        assert (folder / WEIGHTS).read_bytes() == policy
        assert steady(ended["curve"]) == steady(expected["curve"])
        assert steady([ended["law"], ended["policy"]]) == steady([expected["law"], expected["policy"]])
        assert all(later["seconds"] > sooner["seconds"] for sooner, later in pairwise(ended["curve"]))


@pytest.mark.usefixtures("short_probe")
def test_an_interrupt_between_the_two_files_writes_the_policy_as_well(tmp_path, monkeypatch, capsys):
    def interrupted(*args):
        save_checkpoint(*args)
        raise KeyboardInterrupt

    monkeypatch.setattr(monitor, "save_checkpoint", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(TINY, RESIDUAL, tmp_path)
    assert "interrupted after 0 steps: policy and checkpoint are kept in " in capsys.readouterr().out
    assert read_policy(tmp_path).settings == RESIDUAL


CONFIGURATION = """[training]
environment = "BirthSIM/ProbeResidual-v3"
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
@pytest.mark.weekly
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
