"""Work in several processes: one thread each, and an end at once."""

from __future__ import annotations

import os
import time

import pytest

from baselines.side_by_side import side_by_side


def threads(number):
    return number, os.environ["OMP_NUM_THREADS"], os.environ["NUMBA_NUM_THREADS"]


def test_every_process_has_one_thread_and_results_come_with_their_numbers():
    taken = {}
    side_by_side(threads, [(k,) for k in range(5)], 2, taken.__setitem__)
    assert taken == {k: (k, "1", "1") for k in range(5)}


@pytest.mark.filterwarnings("error")
def test_what_the_caller_raises_ends_the_workers_at_once():
    began = time.monotonic()

    def interrupt(number, result):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        side_by_side(time.sleep, [(0,), (600,), (600,)], 2, interrupt)
    assert time.monotonic() - began < 300


def test_what_a_piece_raises_is_raised_here():
    with pytest.raises(ZeroDivisionError):
        side_by_side(divmod, [(1, 1), (1, 0), (1, 2)], 2, lambda number, result: None)
