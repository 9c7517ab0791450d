"""Iterative learning control: the forces that a periodic reference needs, learned lap by lap.

D. A. Bristow, M. Tharayil and A. G. Alleyne, "A survey of iterative learning control", IEEE Control Systems Magazine 26(3),
2006. With what ``piston_loop`` sees, feedback and learned feed-forward f make the force, which is followed at the rate b:
    D* = f(t) + B,   B = m_e (-w^2 e - 2 zeta w de/dt),   u = dF*/dt + dD*/dt + b (D* - D).
What the feedback made the chambers give beyond f in one lap, the feed-forward gives in the next:
    f_next = Q (f + l (D - f)),   Q = 1/4 z^-1 + 1/2 + 1/4 z,
per ``BIN`` of time since the lap began, over which D - f is averaged, so that no lead is needed. Q, which takes both neighbours
of a bin, is the filter that the survey asks for: half of what has 6 Hz is learned, and nothing of what has 12 Hz. Where a lap
needs the same forces as the one before, the error falls to 1 - l of itself with every lap. What differs (pushes of a hand,
setpoints that change) cannot be learned, and in the lap after it what was learned is wrong.

It needs a period, which it finds by itself: a lap ends where the reference comes back to the position and the velocity that it
began with, having been ``AWAY``. Where there is none it learns nothing, and is the feedback alone:

- a reference that rests, stays within ``AWAY`` of where it began, or is not back within ``BIN`` ``BINS`` = 8 s;
- one that leaves the path of the lap before by more than ``STRAY``, or is not back in its time: all is forgotten, and the
  search for a period begins there.

A bin in which a valve saturated all the time is left as it was. Gains found by ``birthsim tune``, as those of ``pid``.
"""

from typing import ClassVar

from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.rivals.feedforward import Tracking
from baselines.rivals.piston_loop import open_valves, piston_error
from baselines.rivals.tracking import TrackingController, is_full
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
from birthsim_env.registry import register

BIN, BINS = 0.04, 200
"""s, and how many a lap has at most; assumed: friction turns over within some bins, and a turn takes up to 8 s."""

AWAY, BACK, STRAY = 5e-3, 2e-3, 2e-3
"""m from where the lap began, or from the path of the lap before; assumed."""

CREEP = 5e-3
"""m/s; assumed: velocities that differ by less, or by half of the first one, are the same."""


class Laps(Rows):
    """What is learned of cylinders 1 and 2, bin by bin, and of the lap."""

    force = rows(2 * BINS, "N", "f that is used")
    learned = rows(2 * BINS, "N", "f + l (D - f) of this lap")
    path = rows(2 * BINS, "m", "x, then y, of the reference where a bin begins")
    total = rows("1 2", "N", "sum of D - f over the periods of this bin")
    count = rows("count1 count2", "1", "how many")
    origin = rows("x y", "m", "where the lap began")
    begun = rows("vx vy", "m/s", "how fast")
    left = row("1", "1 once the reference has been away")
    square = row("m2", "squared distance from the origin a control period ago")
    elapsed = row("s", "since the lap began")
    bin = row("1", "of this lap that runs")
    lap_time = row("s", "the last lap took, or 0")
    fresh = rows("1 2", "1", "1 where it starts")


class Constants(Numbers):
    """Of the stage."""

    period = number("s", "control period")
    bandwidth = number("1/s", "w")
    damping = number("1", "zeta")
    learning = number("1", "l")
    force_rate = number("1/s", "b")
    pneumatic_gain = number("1/s", "c4")
    rig = part(Rig, "the rig as described")


@helper
def finish_bin(laps: Laps, i: int, learning: float) -> None:
    """Learns from the bin that has run."""
    for k in range(2):
        j, count = k * BINS + int(laps.bin[i]), laps.count[k, i]
        mean = laps.total[k, i] / count if count > 0.0 else 0.0
        laps.learned[j, i] = laps.force[j, i] + learning * mean
        laps.total[k, i], laps.count[k, i] = 0.0, 0.0


@helper
def begin_lap(laps: Laps, i: int, asked: Reference, lap_time: float) -> None:
    """Begins a lap, of which the last took ``lap_time``, s: what was learned, filtered, is used; with 0 all is forgotten."""
    used = int(laps.bin[i]) + 1
    for k in range(2):
        for j in range(BINS):
            at, before, after = k * BINS + j, k * BINS + (j + used - 1) % used, k * BINS + (j + 1) % used
            known = lap_time > 0.0 and j < used
            filtered = 0.5 * laps.learned[at, i] + 0.25 * (laps.learned[before, i] + laps.learned[after, i])
            laps.force[at, i] = filtered if known else 0.0
        if lap_time == 0.0:
            laps.origin[k, i], laps.begun[k, i] = asked.position[k, i], asked.velocity[k, i]
            laps.total[k, i], laps.count[k, i] = 0.0, 0.0
        laps.path[k * BINS, i] = asked.position[k, i]
    laps.left[i], laps.square[i], laps.elapsed[i], laps.bin[i], laps.lap_time[i] = 0.0, 0.0, 0.0, 0.0, lap_time


@helper
def follow_lap(laps: Laps, i: int, asked: Reference, learning: float) -> None:
    """Where in a lap lane ``i`` is; ends bins and laps."""
    x, y, elapsed, lap_time = asked.position[0, i], asked.position[1, i], laps.elapsed[i], laps.lap_time[i]
    square = (x - laps.origin[0, i]) ** 2 + (y - laps.origin[1, i]) ** 2
    turned = (asked.velocity[0, i] - laps.begun[0, i]) ** 2 + (asked.velocity[1, i] - laps.begun[1, i]) ** 2
    speed = 0.25 * (laps.begun[0, i] ** 2 + laps.begun[1, i] ** 2)
    if square > AWAY * AWAY:
        laps.left[i] = 1.0
    # The nearest point is one control period ago.
    near = laps.left[i] > 0.0 and laps.square[i] < BACK * BACK and square > laps.square[i]
    late = elapsed >= BIN * BINS or (lap_time > 0.0 and elapsed > lap_time + 2.0 * BIN)
    laps.square[i] = square
    if near and turned <= CREEP * CREEP + speed:
        finish_bin(laps, i, learning)
        begin_lap(laps, i, asked, elapsed)
    elif late:
        begin_lap(laps, i, asked, 0.0)
    else:
        j = int(elapsed / BIN)
        if j != int(laps.bin[i]):
            finish_bin(laps, i, learning)
            strayed = (x - laps.path[j, i]) ** 2 + (y - laps.path[BINS + j, i]) ** 2
            laps.bin[i], laps.path[j, i], laps.path[BINS + j, i] = float(j), x, y
            if elapsed < lap_time and strayed > STRAY * STRAY:
                begin_lap(laps, i, asked, 0.0)


@helper
def recalled(laps: Laps, k: int, i: int) -> tuple[float, float]:
    """f of cylinder ``k``, N, and its rate, N/s: linear between the middles of bins, round the lap."""
    if laps.lap_time[i] == 0.0:
        return 0.0, 0.0
    used = int(laps.lap_time[i] / BIN) + 1
    place = laps.elapsed[i] / BIN + 0.5  # in bins, from the middle of the one before the first
    whole = int(place)
    first, second = laps.force[k * BINS + (whole + used - 1) % used, i], laps.force[k * BINS + whole % used, i]
    return first + (place - whole) * (second - first), (second - first) / BIN


@kernel
def control(world: int, seen: Seen, memory: Laps, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Carries the laps on."""
    tracked, p, period = Tracking(seen.intermediate[: Tracking.size]), constants.rig, constants.period
    w, zeta, b = constants.bandwidth, constants.damping, constants.force_rate
    for i in range(n):
        if memory.fresh[0, i] > 0.0:
            begin_lap(memory, i, seen.asked, 0.0)
        else:
            follow_lap(memory, i, seen.asked, constants.learning)
        for cylinder in range(2):
            now = piston_error(tracked, seen, cylinder, i, p)
            e, v, mass = now.error, now.error_rate, now.mass
            known, known_rate = recalled(memory, cylinder, i)
            given = -mass * w * (w * e + 2.0 * zeta * v)
            given_rate = -mass * w * (w * v + 2.0 * zeta * (now.excess - known) / mass)
            rate = tracked.needed.rate[cylinder, i] + known_rate + given_rate + b * (known + given - now.excess)
            opened = open_valves(seen, cylinder, i, rate, constants.pneumatic_gain, now.air, p)
            if not is_full(opened):
                memory.total[cylinder, i] += now.excess - known
                memory.count[cylinder, i] += 1.0
            memory.fresh[cylinder, i] = 0.0
        memory.elapsed[i] += period
    return 0


@register(
    controller="iterative-learning",
    about="Learns the forces of a periodic reference from lap to lap; without a period it learns nothing.",
    needs={"force sensor"},
    order=38,
)
class IterativeLearning(TrackingController):
    """Iterative learning control about the compliant motion (this module), which learns where the reference is periodic.

    Arguments are those of ``TrackingController``. The gains are friction_fraction and four more: bandwidth: w, 1/s, and
    damping: zeta, of the feedback; learning: l, what of the missing force is learned in a lap; force_rate: b, 1/s.
    """

    LAW, CONSTANTS, MEMORY = staticmethod(control), Constants, Laps
    GAINS: ClassVar[dict[str, tuple[float, float, float, float]]] = {
        "bandwidth": (10.0, 100.0, 64.32, 49.15),
        "damping": (0.3, 2.0, 0.308, 0.332),
        "learning": (0.0, 1.0, 0.1613, 0.8903),
        "force_rate": (30.0, 300.0, 252.8, 263.6),
        "friction_fraction": (0.0, 1.0, 0.4428, 0.9365),
    }

    def _design(self, gains: dict[str, float]) -> dict[str, float]:
        return {"pneumatic_gain": PNEUMATIC_GAIN, **{name: gains[name] for name in Constants.groups if name in gains}}
