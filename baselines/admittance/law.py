"""A stiff loop that follows a reference motion through friction, as a kernel over lanes.

The law of ``cartesian_law`` with one gain c for all directions, with the measured force and with what is known of the rest:
    j = jr - 3 c (a - ar) - (3 c^2 + 2) (v - vr) - (c^3 + 2 c) (x - xr),   m a = J^-T L + m g + Fu,
    L_i = F_i - Fext_i - Fv v_i + unseen_i
with the forces unseen of ``knowledge``: believed friction and what an observer finds besides.

- While pistons rest (``observers``) position errors weigh ``rest_push`` times as much, since stiction, not inertia, has to be
  overcome, and those within ``dead_zone`` move nothing. Once the reference rests the loop has a gain of its own, softer: what
  noise a slow average leaves must not wear the friction down.
- ``watch`` lowers c across or along cylinder 2 where the loop oscillates in that direction: the rig is then slower, lighter
  or held more stiffly than believed.
- Position errors count up to ``MOST_ERROR``, so that the loop comes back calmly from a load that was beyond its strength.
- ``lead``: the commanded opening takes the spool, whose lag is known, where the law wants it.
"""

from __future__ import annotations

from baselines.backstepping.cartesian_law import across, along, load_rates, pressure_openings
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

MEMORY_NAMES = (
    *("gain_fraction_t", "extreme_t", "since_t", "last_peak_t"),
    *("gain_fraction_n", "extreme_n", "since_n", "last_peak_n"),
    "motion_fraction",
)
"""Rows of what a lane remembers: across and along cylinder 2 the fraction of c that oscillations have left, the largest speed
error of this half wave (m/s), the time (s) since it began and the size of the last one; how far the reference was moving of
late."""
MEMORY = len(MEMORY_NAMES)
WATCH_T, WATCH_N, MOTION_FRACTION = 0, 4, 8
GAIN_SHARES = [WATCH_T, WATCH_N]

GAIN_NAMES = (
    *("pneumatic_gain", "gain", "rest_gain", "rest_push", "dead_zone"),
    *("quickness", "oscillation", "yielding", "least_fraction", "most_falls"),
)
"""What ``command`` takes: c4, 1/s; c, 1/s, while the reference moves and while it rests; weight of a resting piston's position
error; its dead zone, m; fraction of the way that a spool is taken in a period; speed error, m/s, beyond which sustained half
waves lower c to ``yielding`` times itself, and what is left of it at least; a half wave n times that speed lowers it
n times, up to ``most_falls``."""

MOTION_TIME = 0.1
"""s; assumed: how long the loop stays as stiff as for motion after the reference has come to rest."""

MOST_ERROR = 0.006
"""m; assumed: no position error counts for more. A larger one, left by a load beyond what the cylinders can hold, is closed at
a speed of c MOST_ERROR/3, which saturated valves can still stop; else the loop swings between its limits."""

HALF_WAVE = 0.2
"""s: a longer half wave of the speed error is no oscillation of the loop."""

SUSTAINED = 0.75
"""A half wave of at least this fraction of the one before is sustained; a transient dies faster."""


@helper
def sustained(memory: Array, row: int, i: int, error: float, period: float, level: float, before: float) -> float:
    """Size of a sustained half wave of a speed error beyond ``level`` that has just ended, else zero.

    One is sustained where the half wave before it went beyond ``before``. Carries three rows of ``memory`` on: the largest
    error of this half wave, the time since it began, the size of the last one.
    """
    extreme = memory[row, i]
    memory[row + 1, i] += period
    if error * extreme < 0.0:
        peak = abs(extreme) if memory[row + 1, i] < HALF_WAVE else 0.0
        last = memory[row + 2, i]
        memory[row, i], memory[row + 1, i], memory[row + 2, i] = error, 0.0, peak
        return peak if peak > level and last > before and peak > SUSTAINED * last else 0.0
    if abs(error) > abs(extreme):
        memory[row, i] = error
    return 0.0


@helper
def watch(
    memory: Array, row: int, i: int, error: float, period: float, level: float, fall: float, least: float, most: float
) -> float:
    """Gain fraction, lowered by ``fall`` down to ``least`` at each sustained half wave of a speed error beyond ``level``: once
    for each whole ``level`` of its size, up to ``most`` times."""
    fraction: float = memory[row, i]
    peak = sustained(memory, row + 1, i, error, period, level, 0.0)
    for _ in range(int(min(peak / level, most))):
        fraction = max(least, fall * fraction)
    memory[row, i] = fraction
    return fraction


@helper
def lead(wanted: float, spool: float, kept: float, quickness: float) -> float:
    """Opening command that takes a spool of known lag a fraction ``quickness`` of the way to ``wanted`` in one period.

    ``kept`` is exp(-period/tau), the fraction of the way that the spool leaves by itself.
    """
    return max(-1.0, min(1.0, spool + quickness * (wanted - spool) / (1.0 - kept)))


@helper
def jerk_for(acceleration: float, speed: float, position: float, c: float) -> float:
    """What errors of acceleration, speed and position take off the jerk with three equal gains c, m/s3."""
    return 3.0 * c * acceleration + (3.0 * c * c + 2.0) * speed + (c * c + 2.0) * c * position


@helper
def beyond(error: float, zone: float) -> float:
    """What of ``error`` exceeds +-``zone``."""
    return error - max(-zone, min(zone, error))


@helper
def command(
    joints: Array, pressures: Array, motion: Array, target: Array, force: Array, disturbance_force: Array, rest: Array,
    moving: Array, spools: Array, p: Array, period: float, gains: Array, told: Array, memory: Array, openings: Array,
) -> None:  # fmt: skip
    """Writes ``openings`` (4, N) and carries ``memory`` (MEMORY, N) on by one period.

    ``joints``, ``pressures``, ``motion``, ``force``, ``disturbance_force``, ``rest``, ``moving`` and ``spools`` are those of
    ``knowledge``; ``target`` (15, N) is the reference; ``gains`` has the order of ``GAIN_NAMES``; ``told`` is what
    ``controller.feedforward_rows`` gives.
    """
    c4, gain, rest_gain, rest_push, dead_zone = gains[0], gains[1], gains[2], gains[3], gains[4]
    quickness, level, fall, least, most = gains[5], gains[6], gains[7], gains[8], gains[9]
    u, kept = scratch(4), exact.exp(-period / p[at.TAU])
    for i in range(joints.shape[1]):
        y1, y2, v1, v2 = joints[0, i], joints[1, i], joints[2, i], joints[3, i]
        pp1, pn1, pp2, pn2 = pressures[0, i], pressures[1, i], pressures[2, i], pressures[3, i]
        m, gravity, atmosphere = p[at.MASS], p[at.GRAVITY], p[at.ATMOSPHERE]
        r4, r2, w, s2, root, kappa, sine, cosine = geometry.pose(
            y1, y2, p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        turn = -2.0 * r4 * v1 / root
        growth = v2 / r2 + v1 / r4 + 2.0 * r4 * w / s2 * v1
        load1 = mechanics.piston_force(pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], atmosphere) - p[at.FV1] * v1
        load2 = mechanics.piston_force(pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], atmosphere) - p[at.FV2] * v2
        load1, load2 = load1 + disturbance_force[0, i] + told[0, i], load2 + disturbance_force[1, i] + told[1, i]

        # Across (t) and along (n) cylinder 2: errors of position, speed and acceleration.
        ex, ey = r2 * sine - motion[0, i], -r2 * cosine - motion[1, i]
        et, en = across(ex, ey, sine, cosine), along(ex, ey, sine, cosine)
        dt = -kappa * v1 - across(motion[2, i], motion[3, i], sine, cosine)
        dn = v2 - along(motion[2, i], motion[3, i], sine, cosine)
        push_t, push_n = across(force[0, i], force[1, i], sine, cosine), along(force[0, i], force[1, i], sine, cosine)
        at_ = (push_t - load1 / kappa) / m - gravity * sine - across(motion[4, i], motion[5, i], sine, cosine)
        an_ = (push_n + load2) / m + gravity * cosine - along(motion[4, i], motion[5, i], sine, cosine)

        fraction_t = watch(memory, WATCH_T, i, dt, period, level, fall, least, most)
        fraction_n = watch(memory, WATCH_N, i, dn, period, level, fall, least, most)
        memory[MOTION_FRACTION, i] = max(moving[i], memory[MOTION_FRACTION, i] * exact.exp(-period / MOTION_TIME))
        c = rest_gain + (gain - rest_gain) * memory[MOTION_FRACTION, i]
        et = (1.0 + (rest_push - 1.0) * rest[0, i]) * beyond(et, rest[0, i] * dead_zone)
        en = (1.0 + (rest_push - 1.0) * rest[1, i]) * beyond(en, rest[1, i] * dead_zone)
        et, en = max(-MOST_ERROR, min(MOST_ERROR, et)), max(-MOST_ERROR, min(MOST_ERROR, en))
        jerk_t = across(motion[6, i], motion[7, i], sine, cosine) - jerk_for(at_, dt, et, fraction_t * c)
        jerk_n = along(motion[6, i], motion[7, i], sine, cosine) - jerk_for(an_, dn, en, fraction_n * c)
        rate1, rate2 = load_rates(load1, load2, growth, turn, kappa, m, jerk_t, jerk_n)
        rate1 += p[at.FV1] * mechanics.acceleration1(
            load1 - kappa * push_t, v1, v2, r2, r4, w, s2, kappa, sine, p[at.INVERSE_MASS], gravity
        )  # fmt: skip
        rate2 += p[at.FV2] * mechanics.acceleration2(load2 + push_n, v1, r2, r4, s2, cosine, p[at.INVERSE_MASS], gravity)
        rate1, rate2 = rate1 - told[2, i], rate2 - told[3, i]
        pressure_openings(
            u, 0, 0, rate1, target[10, i], target[12, i], c4, pp1, pn1, p[at.AREA_P1], p[at.AREA_N1], p[at.HALF_L1], y1, v1, p
        )
        pressure_openings(
            u, 0, 2, rate2, target[11, i], target[13, i], c4, pp2, pn2, p[at.AREA_P2], p[at.AREA_N2], p[at.HALF_L2], y2, v2, p
        )
        for valve in range(4):
            openings[valve, i] = lead(u[valve, 0], spools[valve, i], kept, quickness)
