"""Iterative learning: how fast errors fall from lap to lap, what it keeps of a lap, and where it learns nothing."""

import numpy as np
import pytest

from baselines.rivals.iterative_learning import AWAY, BIN, BINS, IterativeLearning, Laps
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop

TURN = 2.0
"""s."""


def circle(t: float) -> Reference:
    return closed_loop.circling(t, 0.05, TURN, 2000.0)


def lapped(law: IterativeLearning, seconds: float, reference=circle, rig: Parameters = Parameters()) -> Array:  # noqa: B008
    """Distance from the reference at 1 kHz, m, (T,)."""
    plant, far = closed_loop.resting_at(reference(0.0), rig), []
    for _, wanted, _, _ in closed_loop.run(plant, law.command, reference, lambda t: np.zeros((2, 1)), seconds):
        far.append(float(np.hypot(*(plant.end_effector()[:2] - wanted.position)[:, 0])))
    return np.array(far)


def of_laps(far: Array) -> Array:
    """Root mean square of each lap."""
    laps = far[: len(far) // round(1e3 * TURN) * round(1e3 * TURN)].reshape(-1, round(1e3 * TURN))
    return np.sqrt(np.mean(laps**2, axis=1))


def test_errors_fall_from_lap_to_lap_on_a_rig_that_is_not_as_believed() -> None:
    """1 kg heavier, and with half more friction: the fifth lap strays a fifth as far as the first."""
    rig = closed_loop.slippery(1.5).replace({"mechanics.mass": 4.0})
    laps = of_laps(lapped(IterativeLearning(learning=0.7), 6 * TURN, rig=rig))
    plain = of_laps(lapped(IterativeLearning(learning=0.0), 6 * TURN, rig=rig))
    assert laps[4:].max() < 0.2 * laps[0]
    assert plain[4:].min() > 0.8 * plain[0]


@pytest.mark.parametrize("learning", [0.4, 0.8])
def test_an_unknown_weight_is_learned_as_one_minus_l(learning: float) -> None:
    """A constant force, in the middle of Q's band: what is left of the error of a lap is (1 - l) of that of the lap before."""
    rig = closed_loop.IDEAL.replace({"mechanics.gravity": 11.0})
    law = IterativeLearning(closed_loop.IDEAL, learning=learning, friction_fraction=0.0)
    laps = of_laps(lapped(law, 4 * TURN, rig=rig))
    np.testing.assert_allclose(laps[1:3] / laps[:2], 1 - learning, atol=0.08)


def test_what_it_uses_is_the_filtered_sum_of_what_the_feedback_gave() -> None:
    """The lap's bookkeeping done anew in NumPy: D - f of every period, averaged over bins, by Q round the lap."""
    law, given, seen = IterativeLearning(learning=0.5), [], []
    plant = closed_loop.resting_at(circle(0.0), Parameters())
    for _ in closed_loop.run(plant, law.command, circle, lambda t: np.zeros((2, 1)), TURN + 0.05):
        laps = Laps(law._memories[-1])
        seen.append((laps.lap_time[0], laps.force[:BINS, 0].copy()))
        given.append((laps.bin[0], laps.total[0, 0], laps.count[0, 0]))
    ends = [k for k, (time, _) in enumerate(seen) if time > 0]
    assert seen[ends[0]][0] == pytest.approx(TURN, abs=2e-3)
    count = round(TURN / BIN)
    last = {int(j): total / number for j, total, number in given[: ends[0]] if number > 0}
    raw = 0.5 * np.array([last[j] for j in range(count)])
    used = seen[ends[0]][1]
    filtered = 0.5 * raw + 0.25 * (np.roll(raw, 1) + np.roll(raw, -1))
    np.testing.assert_allclose(used[2 : count - 2], filtered[2:-2], rtol=1e-9, atol=1e-9)
    assert not used[count + 1 :].any()


def still(t: float) -> Reference:
    return closed_loop.holding(np.array([[0.5], [0.0]]), 2000.0)


def spiral(t: float) -> Reference:
    """Never twice on the same path."""
    return closed_loop.circling(t, 0.03 + 0.006 * t / TURN, TURN, 2000.0)


def slow(t: float) -> Reference:
    """Turns that take longer than there are bins."""
    return closed_loop.circling(t, 0.02, 1.2 * BIN * BINS, 2000.0)


def small(t: float) -> Reference:
    """Turns that stay within ``AWAY``."""
    return closed_loop.circling(t, 0.45 * AWAY, TURN, 2000.0)


@pytest.mark.parametrize(("reference", "seconds"), [(still, 9.0), (spiral, 9.0), (slow, 11.0), (small, 9.0)])
def test_without_a_period_it_learns_nothing(reference, seconds: float) -> None:
    """It does exactly what it would with l = 0."""
    learns, plain = (lapped(IterativeLearning(learning=one), seconds, reference) for one in (0.7, 0.0))
    np.testing.assert_array_equal(learns, plain)


def test_it_forgets_where_the_path_changes_and_learns_the_new_one() -> None:
    law = IterativeLearning(learning=0.7)
    changed = 3.3 * TURN

    def reference(t: float) -> Reference:
        return closed_loop.circling(t, 0.05 if t < changed else 0.035, TURN, 2000.0)

    plant = closed_loop.resting_at(reference(0.0), Parameters())
    known: list[bool] = []
    for _ in closed_loop.run(plant, law.command, reference, lambda t: np.zeros((2, 1)), 6 * TURN):
        laps = Laps(law._memories[-1])
        known.append(bool(laps.lap_time[0] > 0) and bool(laps.force.any()))
    at = np.array([0.9 * TURN, 3 * TURN, changed + 2 * BIN, changed + 1.2 * TURN])
    assert [known[round(1e3 * t)] for t in at] == [False, True, False, True]
