"""Work in several processes: one thread each, an end at once, and no worker that outlives its parent."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from joblib.externals.loky import process_executor

from baselines.work.side_by_side import side_by_side


def threads(number):
    return number, os.environ.get("OMP_NUM_THREADS"), os.environ.get("NUMBA_NUM_THREADS")


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_with_their_numbers_and_every_process_of_several_has_one_thread(jobs):
    taken = {}
    side_by_side(threads, [(k,) for k in range(5)], jobs, taken.__setitem__)
    assert taken == {k: (k, "1", "1") if jobs == 2 else threads(k) for k in range(5)}


def test_what_the_caller_raises_ends_the_workers_at_once():
    began = time.monotonic()

    def interrupt(number, result):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        side_by_side(time.sleep, [(0,), (600,), (600,)], 2, interrupt)
    assert time.monotonic() - began < 300


def test_a_manager_that_misses_a_cancelled_piece_says_nothing(monkeypatch):
    manager, cancelled = process_executor._ExecutorManagerThread, []
    look = manager.add_call_item_to_queue

    def miss(self):
        if self.executor_flags.kill_workers:
            cancelled.append(1)
            raise KeyError(12)
        look(self)

    monkeypatch.setattr(manager, "add_call_item_to_queue", miss)
    with pytest.raises(ZeroDivisionError):  # pytest fails where a thread ends with an exception that nobody hears
        side_by_side(divmod, [(1, 0), (1, 1)], 2, lambda number, result: None)
    assert cancelled


def test_a_process_that_dies_is_an_error_that_says_so():
    with pytest.raises(OSError, match="has died"):
        side_by_side(os._exit, [(1,), (1,)], 2, lambda number, result: None)


PARENT = """
import os, sys, time
from pathlib import Path
from baselines.work.side_by_side import side_by_side
from tests.work.test_side_by_side import wait_beside
if __name__ == "__main__":
    side_by_side(wait_beside, [(sys.argv[1],), (sys.argv[1],)], 2, lambda number, result: None)
"""


def wait_beside(folder):
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(600)


@pytest.mark.parametrize("ending", [signal.SIGKILL, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_workers_end_with_their_parent_whatever_ends_it(ending, tmp_path):
    parent = subprocess.Popen([sys.executable, "-c", PARENT, str(tmp_path)], stderr=subprocess.DEVNULL)
    try:
        waited_for(lambda: len(list(tmp_path.iterdir())) == 2)
    finally:
        parent.send_signal(ending)
        parent.wait(60)
    workers = [int(path.name) for path in tmp_path.iterdir()]
    waited_for(lambda: not any(is_running(worker) for worker in workers))


def is_running(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{process}/stat")
    # Nobody may be there to bury an orphan.
    return not stat.exists() or stat.read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"


def waited_for(state, seconds=120):
    end = time.monotonic() + seconds
    while not state():
        assert time.monotonic() < end, "that state has not come"
        time.sleep(0.05)
