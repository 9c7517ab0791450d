"""How punctual a drive was, from times that are made by hand."""

import numpy as np
import pytest

from birthsim_drive.loop.timing import timing_of

PERIOD = 1e-3


def test_times_by_hand():
    """Sample 3 arrives 0.4 ms late, the answer to sample 5 takes 1.2 ms, samples 7 and 8 are skipped."""
    times = PERIOD * np.array([0, 1, 2, 3, 4, 5, 6, 9, 10])
    arrived = 100.0 + times
    arrived[3] += 4e-4
    written = arrived + 2e-4
    written[5] = arrived[5] + 1.2e-3
    found = timing_of(times, arrived, written, PERIOD, 7)
    assert found.late == 3
    assert found.missed == 7
    assert np.sort(found.jitter)[-2:].tolist() == pytest.approx([4e-4, 4e-4])
    assert np.sort(found.jitter)[-3] == pytest.approx(0.0, abs=1e-9)
    assert found.computing.max() == pytest.approx(1.2e-3)
    told = found.summary()
    assert told["computing"]["median"] == pytest.approx(2e-4)
    assert sum(told["computing"]["histogram"]) == told["samples"] == 9
    assert "late: 3 of 9" in "\n".join(found.words())


def test_a_rigs_clock_that_drifts_is_no_jitter():
    times = PERIOD * np.arange(60_000)
    arrived = 5.0 + times * (1.0 + 5e-5)
    found = timing_of(times, arrived, arrived + 1e-4, PERIOD, -1)
    assert found.late == 0
    assert found.jitter.max() < 1e-7
    assert "missed" not in "\n".join(found.words())


def test_a_drive_without_samples_has_no_timing():
    none = np.zeros(0)
    found = timing_of(none, none, none, PERIOD, -1)
    assert found.summary()["samples"] == 0
    assert found.words()[-1].startswith("late: 0 of 0")
