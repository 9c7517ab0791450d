"""Trainings that die or are interrupted: they go on, and end with policy, checkpoint and events of one that never was."""

import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from torch.optim.optimizer import register_optimizer_step_post_hook

from agents.policy.files import WEIGHTS, read_policy
from agents.residual.settings import ResidualSettings
from agents.training import reached, watch
from agents.training.by_gradients import policy_gradient
from agents.training.checkpoint import NAME
from agents.training.configuration import override
from agents.training.interruption import Interrupted
from agents.training.sb3 import learner, monitor
from agents.training.sb3.checkpoint import save_checkpoint
from agents.training.trainer import train
from birthsim_env.registry import names
from tests.console import PATIENCE, ROOT, run, strict
from tests.training.brief import TINY, steady
from tests.training.left import checkpoint_left, events_left
from tests.training.test_policy_gradient import BESIDE, INFORMED, PURE, SHORT

RESIDUAL = ResidualSettings("backstepping-force-first", "variable_kp")


class Killed(Exception):
    """Nobody catches it."""


def killed(monkeypatch, settings, residual, folder, place, name, count):
    """Train until a method is entered, or a file is written, for the ``count``-th time."""
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


STEP, ROLLOUT = ((monitor.Monitor, name) for name in ("_on_step", "_on_rollout_start"))
CHECK = watch.Watch, "_validate"
FILES = [(learner, "save_checkpoint", 2), (reached, "save_policy", 2)]
SLOW = pytest.mark.slow
UPDATE = (policy_gradient.PolicyGradient, "_update", 60)
"""Some way beyond the validation half way."""
SAC = replace(TINY, algorithm="sac", steps=384)
REMEMBERS = replace(SHORT, memory=5, horizon=4, lanes=16, steps=1024, privileged=True)
RECURRENT = replace(TINY, algorithm="recurrent-ppo", memory=6)
BETTER = replace(TINY, seed=3)
"""Becomes better than the law, so that its policy is written twice."""
LAB = replace(TINY, sensors="lab", environment="BirthSIM/CircleResidual-v2")


@pytest.mark.parametrize(
    ("settings", "residual", "places"),
    [
        pytest.param(BETTER, RESIDUAL, [(*STEP, 1), (*STEP, 127), (*CHECK, 2), (*ROLLOUT, 5), *FILES], marks=SLOW, id="ppo"),
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
        assert checkpoint_left(folder) == checkpoint_left(tmp_path / "whole")
        assert events_left(folder) == events_left(tmp_path / "whole")


BRIEFLY = {
    **{name: {"steps": 512, "rollout": 4, "batch": 16} for name in ("ppo", "recurrent-ppo", "apg")},
    **{name: {"steps": 512} for name in ("sac", "tqc")},
}
"""What makes a training of ``TINY`` brief, with several updates between two validations."""

LONG = {"apg": SLOW, "sac": SLOW, "tqc": pytest.mark.weekly}
"""Those of which it takes long all the same."""


@contextmanager
def optimized(act, count):
    """Call ``act`` at the ``count``-th step of an optimizer, within an update of whatever algorithm."""
    steps = []

    def hook(*_):
        steps.append(None)
        if len(steps) == count:
            act()

    handle = register_optimizer_step_post_hook(hook)
    try:
        yield steps
    finally:
        handle.remove()


def said(printed):
    """The steps that a training has said it keeps, and those from which one has gone on; None where it says nothing."""
    found = [re.findall(rf"([\d,]+) of [\d,]+ steps are {word}", printed) for word in ("kept in", "there and are kept")]
    return [int(one[-1].replace(",", "")) if one else None for one in found]


def die():
    raise Killed


@pytest.mark.parametrize(
    "algorithm",
    [
        pytest.param(name, marks={"apg": SLOW, "sac": SLOW, "tqc": pytest.mark.weekly}.get(name, ()))
        for name in names("algorithm")
    ],
)
@pytest.mark.usefixtures("short_probe")
def test_nothing_is_lost_by_ctrl_c_and_an_update_by_a_kill_and_all_is_as_if_nothing_had_been(
    tmp_path, monkeypatch, capsys, algorithm
):
    """In an update between two validations. With checkpoints at all updates, which the whole training is without."""
    settings = override(TINY, algorithm=algorithm, **BRIEFLY.get(algorithm, {}))
    monkeypatch.setattr(watch, "PERIOD", np.inf)
    with optimized(die, 0) as steps:
        train(settings, RESIDUAL, tmp_path / "whole")
    whole, between = tmp_path / "whole", len(steps) // settings.validations
    folder, begun = tmp_path / "out", []

    def interrupt():
        begun.append(seen[-1])
        signal.raise_signal(signal.SIGINT)

    seen, updated = [], watch.Watch.updated

    def watched(own):
        updated(own)
        seen.append(own._learner.steps)

    monkeypatch.setattr(watch.Watch, "updated", watched)
    capsys.readouterr()
    with optimized(interrupt, between + between // 2), pytest.raises(KeyboardInterrupt):
        train(settings, RESIDUAL, folder)
    kept, _ = said(capsys.readouterr().out)
    curve = [point["steps"] for point in checkpoint_left(folder)["past"]["reached"]["curve"]]
    assert kept == seen[-1] > begun[0] > curve[-1], "the update is there in which it came, and it came between two validations"
    monkeypatch.setattr(watch, "PERIOD", 0.0)
    seen.clear()
    with optimized(die, between // 2 + between // 3), pytest.raises(Killed):
        train(settings, RESIDUAL, folder)
    assert said(capsys.readouterr().out) == [None, kept]
    last = seen[-1]
    assert last > kept
    train(settings, RESIDUAL, folder)
    assert said(capsys.readouterr().out) == [None, last], "the update is lost in which it died, and no other"
    assert (folder / WEIGHTS).read_bytes() == (whole / WEIGHTS).read_bytes()
    assert checkpoint_left(folder) == checkpoint_left(whole)
    assert events_left(folder) == events_left(whole)
    assert all(len(dict(points)) == len(points) for points in events_left(whole).values()), "a step has one point"


@pytest.mark.parametrize("validating", [True, False])
@pytest.mark.usefixtures("short_probe")
def test_ctrl_c_at_the_end_leaves_what_is_missing_to_the_next(tmp_path, monkeypatch, capsys, validating):
    """While the last policy is validated, or in the last update, after which it is not."""
    train(TINY, RESIDUAL, tmp_path / "whole")
    validate, count = reached.Reached.validate, []

    def interrupted(own, network):
        count.append(signal.raise_signal(signal.SIGINT) if len(count) == TINY.validations - 1 else None)
        return validate(own, network)

    with monkeypatch.context() as patch:
        if validating:
            patch.setattr(reached.Reached, "validate", interrupted)
        at_the_end = optimized(lambda: signal.raise_signal(signal.SIGINT), 0 if validating else 16)
        with at_the_end, pytest.raises(KeyboardInterrupt):
            train(TINY, RESIDUAL, tmp_path / "out")
    assert said(capsys.readouterr().out) == [TINY.steps, None]
    left = checkpoint_left(tmp_path / "out")["past"]["reached"]["curve"]
    assert (left[-1]["steps"] == TINY.steps) == validating
    train(TINY, RESIDUAL, tmp_path / "out")
    for found in (checkpoint_left, events_left):
        assert found(tmp_path / "out") == found(tmp_path / "whole")


@pytest.mark.usefixtures("short_probe")
def test_a_second_ctrl_c_comes_at_once_and_what_is_said_to_be_kept_is(tmp_path, capsys):
    def twice():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("it goes on")

    with optimized(twice, 10), pytest.raises(KeyboardInterrupt):
        train(TINY, RESIDUAL, tmp_path)
    kept, _ = said(capsys.readouterr().out)
    assert kept == checkpoint_left(tmp_path)["counts"][0] == 512
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.usefixtures("short_probe")
def test_a_handler_that_raises_nothing_does_not_make_a_training_complete(tmp_path):
    came, before = [], signal.signal(signal.SIGTERM, lambda number, _: came.append(number))
    try:
        with optimized(lambda: signal.raise_signal(signal.SIGTERM), 10), pytest.raises(Interrupted, match="640 of 1,024 steps"):
            train(TINY, RESIDUAL, tmp_path)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert came == [signal.SIGTERM]


@pytest.mark.usefixtures("short_probe")
def test_an_interrupt_between_the_two_files_writes_the_policy_as_well(tmp_path, monkeypatch, capsys):
    def interrupted(*args):
        save_checkpoint(*args)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(learner, "save_checkpoint", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(TINY, RESIDUAL, tmp_path)
    assert said(capsys.readouterr().out) == [0, None]
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
    assert checkpoint_left(cut) == checkpoint_left(whole)
    assert events_left(cut) == events_left(whole)
    assert steady(strict(cut / "training.json")["curve"]) == steady(strict(whole / "training.json")["curve"])
