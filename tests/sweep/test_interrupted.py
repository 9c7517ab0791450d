"""Ctrl-C in a sweep whose trainings run in several processes: each writes a checkpoint of what it has learned, and goes on."""

import re
import signal
import time

import pytest

from agents.policy.sealed import unsealed
from agents.training.checkpoint import FORMAT, NAME, _nested
from agents.training.watch import PERIOD
from birthsim_env.partials import HIDDEN
from tests.console import PATIENCE
from tests.kills.running import Running

SWEEP = """
[base]
train = "circle_quick"
episodes = 2
"training.environment" = "BirthSIM/ProbeResidual-v3"
"training.steps" = 2_000_000
"training.lanes" = 16
"training.batch" = 256
"training.validations" = 1
"training.validation_lanes" = 2
[grid]
"training.seed" = [0, 1]
"""


def steps_kept(path):
    """Of a checkpoint."""
    arrays, about = unsealed(path.read_bytes(), FORMAT)
    return _nested(about["content"], arrays)["counts"][0]


@pytest.mark.slow
def test_nothing_that_was_learned_is_lost(tmp_path):
    """Between the checkpoint of the first validation and the one that time would bring."""
    (tmp_path / "sweep.toml").write_text(SWEEP)
    out = tmp_path / "out"
    with Running(["sweep", str(tmp_path / "sweep.toml"), "--jobs", "2", "--out", str(out)], tmp_path) as running:
        until = time.monotonic() + PATIENCE
        # One that is being written lies in a folder of its own until it is complete.
        while len(found := [path for path in out.rglob(NAME) if HIDDEN not in path.parts]) < 2:
            assert time.monotonic() < until
            assert not running.ended(), running.stderr()[-2000:]
            time.sleep(0.05)
        began = time.monotonic()
        time.sleep(3.0)
        assert max(map(steps_kept, found)) == 0
        assert time.monotonic() - began < PERIOD, "no checkpoint was due by time"
        running.signal(signal.SIGINT, group=True)
        assert running.status() != 0
        running.assert_nobody_lives()
        said = (tmp_path / "run.stdout").read_text()
    kept = {steps_kept(path) for path in found}
    assert min(kept) > 0
    assert {int(one.replace(",", "")) for one in re.findall(r"([\d,]+) of 2,000,000 steps are kept in", said)} == kept
    assert "sweep: 0 of 2 are complete and kept; the same command goes on" in said
