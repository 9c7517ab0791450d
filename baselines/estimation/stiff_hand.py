"""Whether a stiff hand makes the head swing, from how force and motion of the swing belong together.

The loop from the hand's force to the motion that answers it, and through the hand's stiffness k back to the force, has the gain
k/|m s^2 + B s + K|. Beyond some 7 kN/m this is more than 1 where valves, tracker and soft friction are late by 40 degrees, at 9
to 14 Hz: then the head swings in the hand. A heavier and more damped motion lowers that gain (``admittance``), and a loop that
is less stiff than the hand leaves to the hand what it holds itself.

A hand that is a spring holds the head where it was, so that force and motion of the swing are opposite, F = -k x, whatever its
frequencies. A hand that pushes by itself finds the declared impedance, whose motion is late by an angle that depends on the
frequency. So with x and F the swings of position and force along an axis, and < > averages over ``MEMORY``,
    compliance = -<F x>/<F F>,   agreement = <F x>^2/(<F F> <x x>)
tell the two apart. A stiff hand is felt where the force swings by more than ``LEAST``, the compliance is less than 1/``STIFF``
but more than noise explains, and the agreement is more than ``AGREEMENT``, for longer than ``LASTING``.

One thing looks alike: a hand whose force is one lone sine of 8 to 16 Hz. So the answer is a trial. Where the swing goes on in
spite of it, it is the hand's own, and the answer is withdrawn until the swing ends or doubles.
The answer stays while the head rests in the hand, as nothing then tells that the hand has gone. It ends once the head moves and
the force is less than half of that of a spring ``STIFF``, or along the motion.

Position and force are the same band-passed, and the force is as late as the position. The tracker's noise is taken off <x x>.
"""

import math

from birthsim_env.loop.rows import Signals
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows

SLOWEST, FASTEST = 25.0, 150.0
"""1/s, of the high-pass and of the low-pass; loops in a clamp swing at 40 to 130 1/s."""

MEMORY = 0.25
"""s; assumed: two to five swings are averaged."""

LEAST = 0.8
"""N, root mean square of a force that swings; found by trial. A force sensor's noise in the band is below 0.1 N."""

STIFF = 7000.0
"""N/m; found by trial: arms and grips have less, and no loop swings in their hands."""

AGREEMENT = 0.7
"""assumed; a damper of k/(2 w) beside the spring leaves 0.8."""

CERTAIN = 3.0
"""Standard deviations of noise that the compliance must exceed."""

ONSET, RECOVERY = 0.05, 0.2
"""s in which an answer comes while a stiff hand is felt, and goes while the motion tells that there is none."""

LASTING = 0.1
"""s; assumed: a stiff hand that is felt for less long, as when one that pulled lets go, is none."""

TRIAL, LEFT, LARGE = 0.8, 0.5, 4.0
"""s, 1 and 1: after so long an answer, a swing with more than ``LEFT`` of its mean square and ``LARGE`` times the least one
is the hand's own; assumed."""

UNLIKELY, SEEN = 2.0, 3e-5
"""1 and m: a mean square of the motion that exceeds that of noise by so many times, and by that of ``SEEN``, is no noise. Less
tells nothing of a hand that is gone."""

GONE = 0.01
"""An answer below this part is none."""


class StiffHand(Rows):
    """What is remembered of the swing."""

    felt = row("1", "how far a stiff hand is answered, 0 to 1; 0 at a new start")
    lasting = row("s", "how long it has been felt without a break")
    answered = row("s", "how long it has been answered")
    before = row("N2", "mean square of the force when the answer began")
    doubted = row("1", "1 while the swing goes on in spite of the answer")
    newest = row("s", "time of the newest sample")
    late = rows("Fx Fy", "N", "force, as late as positions are")
    slow_force = rows("slow_Fx slow_Fy", "N", "what of it does not swing")
    slow_position = rows("slow_x slow_y", "m", "what of the position does not swing")
    force = rows("swing_Fx swing_Fy", "N", "swing of the force")
    position = rows("swing_x swing_y", "m", "swing of the position")
    forces = rows("FFx FFy", "N2", "mean square of the force")
    products = rows("Fxx Fxy", "N m", "mean product")
    squares = rows("xx yy", "m2", "mean square of the position")


@helper
def _share(bandwidth: float, time: float) -> float:
    """Of a low-pass with ``bandwidth``, 1/s, after ``time``, s."""
    return bandwidth * time / (1.0 + bandwidth * time)


@helper
def _begin(hand: StiffHand, signals: Signals, force: Array, i: int) -> None:
    hand.felt[i], hand.lasting[i], hand.newest[i] = 0.0, 0.0, signals.position_time[i]
    hand.answered[i], hand.before[i], hand.doubted[i] = 0.0, 0.0, 0.0
    for axis in range(2):
        hand.late[axis, i] = hand.slow_force[axis, i] = force[axis, i]
        hand.slow_position[axis, i] = signals.position[axis, i]
        hand.force[axis, i] = hand.position[axis, i] = 0.0
        hand.forces[axis, i] = hand.products[axis, i] = hand.squares[axis, i] = 0.0


@helper
def _take(hand: StiffHand, signals: Signals, i: int, sampled: float) -> None:
    """Takes a position ``sampled`` s after the last one."""
    slow, fast, new = _share(SLOWEST, sampled), _share(FASTEST, sampled), _share(1.0 / MEMORY, sampled)
    for axis in range(2):
        hand.slow_force[axis, i] += slow * (hand.late[axis, i] - hand.slow_force[axis, i])
        hand.slow_position[axis, i] += slow * (signals.position[axis, i] - hand.slow_position[axis, i])
        f, x = hand.late[axis, i] - hand.slow_force[axis, i], signals.position[axis, i] - hand.slow_position[axis, i]
        hand.force[axis, i] += fast * (f - hand.force[axis, i])
        hand.position[axis, i] += fast * (x - hand.position[axis, i])
        f, x = hand.force[axis, i], hand.position[axis, i]
        hand.forces[axis, i] += new * (f * f - hand.forces[axis, i])
        hand.products[axis, i] += new * (f * x - hand.products[axis, i])
        hand.squares[axis, i] += new * (x * x - hand.squares[axis, i])


@helper
def _holds(hand: StiffHand, i: int, axis: int, noise: float, sampled: float) -> float:
    """1 where a stiff hand is felt along an axis, -1 where the motion tells that there is none, else 0.

    Positions have a noise of ``noise``, m.
    """
    forces, against, fast = hand.forces[axis, i], -hand.products[axis, i], _share(FASTEST, sampled)
    spread = noise * noise * fast / (2.0 - fast)
    certain = CERTAIN * math.sqrt(spread * forces / (1.0 + MEMORY * FASTEST / 2.0))
    squares = hand.squares[axis, i] - spread
    if squares > UNLIKELY * spread + SEEN * SEEN and (4.0 * forces < STIFF * STIFF * squares or against < -certain):
        return -1.0
    swings = forces > LEAST * LEAST and against > certain and against * STIFF < forces
    return 1.0 if swings and against * against > AGREEMENT * forces * squares else 0.0


@helper
def _answer(hand: StiffHand, i: int, holds: float, sampled: float) -> float:
    """How far a hand that ``holds`` is answered from now on."""
    swing, least, felt = hand.forces[0, i] + hand.forces[1, i], LEAST * LEAST, hand.felt[i]
    if hand.doubted[i] > 0.0 and (swing < least or swing * LEFT > hand.before[i]):
        hand.doubted[i], hand.answered[i] = 0.0, 0.0
    hand.lasting[i] = hand.lasting[i] + sampled if holds > 0.0 else 0.0
    if felt > 0.0:
        hand.answered[i] += sampled
        if hand.answered[i] < LASTING:
            hand.before[i] = max(hand.before[i], swing)
        elif TRIAL < hand.answered[i] < TRIAL + LASTING and swing > max(LEFT * hand.before[i], LARGE * least):
            hand.doubted[i] = 1.0
    elif hand.doubted[i] == 0.0:
        hand.answered[i], hand.before[i] = 0.0, 0.0
    if hand.doubted[i] > 0.0 or holds < 0.0:
        felt -= felt * min(1.0, sampled / RECOVERY)
    elif hand.lasting[i] > LASTING:
        felt += (1.0 - felt) * min(1.0, sampled / ONSET)
    return felt if felt > GONE else 0.0


@helper
def observe(hand: StiffHand, signals: Signals, force: Array, noise: Array, period: float, fresh: Array) -> None:
    """Carries ``hand`` on by one period; ``force`` (2, N), N, is the hand's and ``noise`` (N,), m, that of a position."""
    for i in range(fresh.shape[0]):
        if fresh[i] > 0.0:
            _begin(hand, signals, force, i)
        age = signals.time[i] - signals.position_time[i]
        sampled = signals.position_time[i] - hand.newest[i]
        for axis in range(2):
            hand.late[axis, i] += period / (period + age) * (force[axis, i] - hand.late[axis, i])
        if sampled > 0.0:
            hand.newest[i] = signals.position_time[i]
            _take(hand, signals, i, sampled)
            x, y = _holds(hand, i, 0, noise[i], sampled), _holds(hand, i, 1, noise[i], sampled)
            hand.felt[i] = _answer(hand, i, max(x, y) if max(x, y) > 0.0 else min(x, y), sampled)
