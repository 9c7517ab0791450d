"""A training on a disk without room."""

import errno
import os
import threading

import pytest

from agents.training.trainer import train
from tests.training.test_training import BRIEF, RESIDUAL


@pytest.mark.parametrize("writes", [0, 1, 5, 30])
def test_a_full_disk_is_said_once_with_the_place_and_without_a_traceback(tmp_path, monkeypatch, capsys, short_probe, writes):
    """TensorBoard writes in a thread of its own."""
    from tensorboard.summary.writer.record_writer import RecordWriter

    done, write = [], RecordWriter.write

    def full(self, data):
        done.append(data)
        if len(done) > writes:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(self, data)

    hook = threading.excepthook
    with monkeypatch.context() as patch:
        patch.setattr(RecordWriter, "write", full)
        with pytest.raises(OSError, match="No space left on device") as caught:
            train(BRIEF, RESIDUAL, tmp_path)
    assert caught.value.filename == str(tmp_path / "tensorboard")
    assert "Traceback" not in capsys.readouterr().err
    assert threading.excepthook is hook
    # With room again, the same command goes on.
    assert train(BRIEF, RESIDUAL, tmp_path)["curve"][-1]["steps"] == BRIEF.steps
