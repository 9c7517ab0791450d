"""A drive has processes of its own also where it is one of several pieces of work side by side."""

from baselines.work.side_by_side import side_by_side
from birthsim_drive import session

PATIENCE = 120.0


def begins(number: int) -> bool:
    ready = session._APART.Event()
    process = session._started(ready.set)
    process.join(PATIENCE)
    return process.exitcode == 0 and ready.is_set()


def test_a_worker_of_joblib_can_start_the_processes_of_a_drive():
    found = {}
    side_by_side(begins, [(0,), (1,)], 2, found.__setitem__)
    assert found == {0: True, 1: True}
