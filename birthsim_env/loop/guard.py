"""What enters a controller is finite: a sample that is not is replaced by the last good one, counted, and ends the control
where it lasts.

Where signals come from outside, the first stage of every compiled controller looks at what is measured and asked for, and its
last one at the openings. So the rule is the same for ``command``, for a user's own sensors in Gymnasium, in C, in WebAssembly
and in an FMU. Parts of the package say finite numbers; in a loop of these alone nothing has to be looked at:

- A *signal* is what one sensor says: the clock, the position with its time, the velocity, the acceleration, the pressure of a
  chamber, the hand's force; and what is asked for. It is *good* where all its numbers are finite and within ``Limits.most``,
  and where a position, measured or asked for, is not that of the pivot (``NEAREST``) and none of the future (``AHEAD``).
- What is not good is replaced by the last good one, so that no memory of a controller takes it up. A late position keeps its
  time, because it is then no new sample.
- Until each signal that the controller reads was good once, the valves stay closed.
- Where such a signal is not good for longer than ``Limits.patience``, the control has *ended*: the valves get
  ``Limits.opening`` until the controller is reset, because nobody knows where the rig has gone in the meantime.
- What is asked for is different: it comes from a program, not from a sensor. The stage counts it as something that it could not
  serve, so that Python refuses it by name.

Signals that are good pass without a change of a bit.
"""

from collections.abc import Iterable

import numpy as np

from birthsim_env.loop.rows import Seen, Signals
from birthsim_env.loop.signals import Reference
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, row, rows
from birthsim_env.physics.linkage.geometry import end_effector
from birthsim_env.physics.rig.parameters import Parameters

SIGNALS = ("time", "position", "velocity", "acceleration", "Pp1", "Pn1", "Pp2", "Pn2", "user_force", "reference")
"""Names of the signals."""

_CLOCK, _FIX, _ASKED = SIGNALS.index("time"), SIGNALS.index("position"), SIGNALS.index("reference")
"""The clock is also the first row of ``Signals``."""


def _signal_of_rows() -> tuple[int, ...]:
    names = {"position_time": "position"}
    of = []
    for name, group in Signals.groups.items():
        own = SIGNALS[4:8] if name == "pressure" else [names.get(name, name)] * group.count
        of += [SIGNALS.index(one) for one in own]
    return tuple(of)


_SIGNAL, _COUNT, _ROWS = _signal_of_rows(), len(SIGNALS), Signals.size

MOST = {
    "time": 1e12, "position_time": 1e12, "velocity": 1e3, "acceleration": 1e5, "user_force": 1e5, "reference": 1e12,
}  # fmt: skip
"""SI; assumed: a larger number is no sample of such a rig. ``limits`` adds position and pressure, which follow from the rig."""

BEYOND = 10.0
"""So many times the reach of the rig, and its supply pressure, are still good; assumed."""

NEAREST = 1e-3
"""m from the pivot of cylinder 2, assumed: what is nearer is the zero of a tracker without its sensor. At the pivot no cylinder
has a direction, so that a law would remember NaN."""

AHEAD = 1.0
"""s, assumed: a position may be so much later than the clock, where two clocks differ."""

ON_FAULT = {"hold": 0.0, "vent": -1.0}
"""What the valves get once the control has ended: closed, or all chambers to the exhaust (a 5/3 valve cannot, and closes)."""

FAULT_TIME = 0.03
"""s, by default: 95 of 100 heads stray by some 5 mm at most.

Measured by ``birthsim study missing-samples --lanes 32``."""

STIFFNESS, PNEUMATIC = 2000.0, (3600.0, 1800.0)
"""N/m; assumed: what is asked for until something good is."""


class Limits(Numbers):
    """Constants of both stages."""

    most = rows(_ROWS, "SI", "largest absolute value of a good number, by row of ``Signals``")
    needed = rows(_COUNT, "1", "1 where the controller reads the signal")
    patience = number("1", "control periods that a needed signal may be missing")
    opening = number("1", "opening of all valves once the control has ended")
    period = number("s", "control period")


class LastGood(Rows):
    """What the first stage remembers."""

    good = rows(_ROWS, "SI", "last good number, by row of ``Signals``")
    age = rows(_COUNT, "1", "control periods since the signal was good; infinite before")
    missed = row("1", "control periods in which a needed signal was replaced")
    late = row("1", "1 where one of the signals was not good in the last period")
    waits = row("1", "1 where a needed signal was not good yet")
    ended = row("1", "1 where the control has ended")


class MissingSignals(Rows):
    """What a lane is found to lack."""

    bad = rows(_COUNT, "1", "1 where a signal is not good")
    any = row("1", "1 where one is, or was in the last period")


@helper
def _replace(signals: Array, bad: Array, kept: LastGood, constants: Limits, n: int) -> None:
    """Puts the last good signal in the place of what is ``bad``, and counts."""
    for k in range(_ROWS):
        signal = _SIGNAL[k]
        for i in range(n):
            signals[k, i] = kept.good[k, i] if bad[signal, i] > 0.0 else signals[k, i]
    for signal in range(_COUNT):
        needed = constants.needed[signal]
        for i in range(n):
            age = kept.age[signal, i] + 1.0 if bad[signal, i] > 0.0 else 0.0
            kept.age[signal, i] = age
            bad[signal, i] *= needed
    for i in range(n):
        worst, oldest, late = 0.0, 0.0, 0.0
        for signal in range(_COUNT):
            worst, late = max(worst, bad[signal, i]), max(late, kept.age[signal, i])
            oldest = max(oldest, kept.age[signal, i] if constants.needed[signal] > 0.0 else 0.0)
        kept.missed[i] += worst
        kept.late[i] = min(late, 1.0)
        kept.waits[i] = 1.0 if oldest == np.inf else 0.0
        kept.ended[i] = max(kept.ended[i], 1.0 if oldest > constants.patience and oldest < np.inf else 0.0)


@helper
def _is_at_pivot(x: float, y: float) -> float:
    """1 where a position, m, is nearer to the pivot than ``NEAREST``."""
    return 1.0 if max(abs(x), abs(y)) < NEAREST else 0.0


@kernel
def let_pass(world: int, seen: Seen, kept: LastGood, constants: Limits, tables: int, lane: int, n: int) -> int:
    """Replaces what is not good; returns how many lanes are asked for something that is not."""
    signals, found, refused = seen.rows[:_ROWS], MissingSignals(scratch(MissingSignals.size)), 0
    bad = found.bad
    for i in range(n):
        found.any[i] = kept.late[i]
        # What stands in for a clock that fails.
        kept.good[_CLOCK, i] += constants.period
    for signal in range(_COUNT):
        for i in range(n):
            bad[signal, i] = 0.0
    for k in range(_ROWS):
        signal, most = _SIGNAL[k], constants.most[k]
        for i in range(n):
            # A comparison with what is not a number is false.
            beyond = 0.0 if abs(signals[k, i]) <= most else 1.0
            bad[signal, i], found.any[i] = max(bad[signal, i], beyond), max(found.any[i], beyond)
    for i in range(n):
        clock = kept.good[_CLOCK, i] if bad[_CLOCK, i] > 0.0 else seen.time[i]
        beyond = 1.0 if seen.position_time[i] - clock > AHEAD else 0.0
        beyond = max(beyond, _is_at_pivot(seen.position[0, i], seen.position[1, i]))
        bad[_FIX, i], found.any[i] = max(bad[_FIX, i], beyond), max(found.any[i], beyond)
        beyond = _is_at_pivot(seen.reference.position[0, i], seen.reference.position[1, i])
        bad[_ASKED, i], found.any[i] = max(bad[_ASKED, i], beyond), max(found.any[i], beyond)
    some = 0.0
    for i in range(n):
        some = max(some, found.any[i])
        refused += 1 if bad[_ASKED, i] > 0.0 else 0
    if some > 0.0:
        _replace(signals, bad, kept, constants, n)
    for k in range(_ROWS):
        for i in range(n):
            kept.good[k, i] = signals[k, i]
    for i in range(n):
        seen.missed[i], seen.fault[i] = kept.missed[i], max(2.0 * kept.ended[i], kept.waits[i])
    return refused


@kernel
def end(world: int, seen: Seen, memory: int, constants: Limits, tables: int, lane: int, n: int) -> int:
    """Closes the valves of lanes that wait for a first sample, and opens them as the owner chose where control has ended."""
    for valve in range(4):
        for i in range(n):
            still = 0.0 if seen.fault[i] == 1.0 else constants.opening
            seen.opening[valve, i] = seen.opening[valve, i] if seen.fault[i] == 0.0 else still
    return 0


def limits(rig: Parameters, reads: Iterable[str], on_fault: str, fault_time: float) -> Array:
    """Constants of both stages.

    Parameters
    ----------
    rig
        As the controller believes it; its reach and supply pressure bound what is good.
    reads
        Signals without which the controller cannot work, of ``SIGNALS``.
    on_fault
        One of ``ON_FAULT``.
    fault_time
        s, for which such a signal may be missing.
    """
    reach = BEYOND * (rig.geometry.k2 + rig.cylinder2.stroke)
    most = {**MOST, "position": reach, "pressure": BEYOND * rig.air.supply_pressure}
    period = rig.electronics.control_period
    return Limits.numbers(
        most=np.concatenate([np.full(group.count, most[name]) for name, group in Signals.groups.items()]),
        needed=[float(signal in set(reads)) for signal in SIGNALS],
        patience=round(fault_time / period),
        opening=ON_FAULT[on_fault],
        period=period,
    )


def fresh(rig: Parameters) -> Array:
    """What a lane (``LastGood.size``,) remembers where it starts: what stands in for a signal that was not good yet.

    The end effector rests at the centre of its workspace, and is asked to.
    """
    x, y = end_effector(np.zeros(2), rig)
    pressure = 0.5 * (rig.air.supply_pressure + rig.air.atmospheric_pressure)
    reference = Reference.lane(position=[x, y], stiffness=STIFFNESS, pneumatic_stiffness=PNEUMATIC)
    good = Signals.lane(position=[x, y], pressure=pressure, reference=reference)
    return LastGood.lane(good=good, age=np.inf, late=1.0, waits=1.0)


def require_good(reference: Reference) -> None:
    """Raise ``ValueError`` that names the first entry of ``reference`` (15, N) that is not good, and its lane."""
    bad = ~(np.abs(reference.rows) <= MOST["reference"])
    if bad.any():
        place, lane = (int(k) for k in np.argwhere(bad)[0])
        name, unit, about, _ = list(Reference.entries())[place]
        raise ValueError(
            f"reference: {name} = {reference.rows[place, lane]:g} {unit} ({about}) in lane {lane}; "
            f"allowed: finite numbers, at most {MOST['reference']:g}"
        )
    pivot = np.abs(reference.position).max(axis=0) < NEAREST
    if pivot.any():
        raise ValueError(
            f"reference: position is the pivot of cylinder 2 in lane {int(np.argmax(pivot))}; "
            f"allowed: a position at least {NEAREST:g} m away"
        )
