"""What a rig is, from what its chambers and pistons do under a law: a Kalman filter of ten parameters.

The state is the logarithm of each parameter over that of the rig as described, constant in time. It begins with the rig as
described, as uncertain as ``TOLD`` says that rigs are spread, and two kinds of measurement correct it.

Chambers, every period. An observer of pressures expects P and measures another; how P depends on the parameters follows from
its own recursion,
    expected = P + T P'(P, s; theta),   P+ = (1 - f) expected + f measured,   psi+ = (1 - f)(psi + T dP'/d theta),
    measured - expected = psi (theta - believed) + noise
(a recursive prediction error, Ljung 1999, section 11.4). How P' depends on P is left out of psi, which with f = 0.2 changes it
by less than a tenth. A constant bias of a cell leaves no trace.

Pistons, every ``EVERY`` s. Let alpha be the specific force on the head along a piston, as the observer of pistons finds it, and
s the friction along the motion over its level, as far as the piston moves like that. Then
    m alpha + Fv v + Fc s - A (pP - pN) = Fhand + rod (pN - p0)
where all but alpha is low-passed three times, because the observer delays alpha.

Slopes hold near what is believed, so that the mean must not run ahead of it: ``UNEVEN_FLOWS`` and ``UNEVEN_FORCES`` slow it.
"""

import math

import numpy as np

from baselines.estimation import dry_friction
from baselines.valve_inverse import driving_flows, valve_of
from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Rows, row, rows
from birthsim_env.physics.compiled.stack import column
from birthsim_env.physics.pneumatics import valves
from birthsim_env.physics.rig.parameters import Parameters, value_of

TOLD = {
    "mechanics.mass": (1.0, 10.0), "air.supply_pressure": (4e5, 9e5),
    "cylinder1.coulomb_friction": (4.0, 36.0), "cylinder2.coulomb_friction": (5.0, 45.0),
    "cylinder1.viscous_friction": (10.0, 105.0), "cylinder2.viscous_friction": (10.0, 105.0),
    "cylinder1.piston_diameter": (0.020, 0.032), "cylinder2.piston_diameter": (0.020, 0.032),
    "valves.time_constant": (0.0015, 0.008), "chambers.dead_volume": (8.1e-6, 3e-5),
}  # fmt: skip
"""Parameters that are found, SI units, and the range of each, over which its logarithm is spread evenly; assumed."""

MASS, SUPPLY, COULOMB, VISCOUS, BORE, LAG, DEAD, INDEX, SIZE = 0, 1, 2, 4, 6, 8, 9, 10, 11
"""Places of the parameters, the first of two where each cylinder has its own."""

OF_CHAMBER, ON_SUPPLY, ON_BORE, ON_LAG, ON_DEAD, ON_INDEX = 5, 0, 1, 2, 3, 4
"""How many parameters a chamber's pressure depends on, and their places among these."""

CYLINDER = at.AREA_P2 - at.AREA_P1
"""Rows from one cylinder to the other."""

BALANCE, HAND, SPECIFIC, SPEED, SLIDING, DIFFERENCE = 5, 0, 1, 2, 3, 4
"""How many signals a piston's balance of forces has, and their places."""

EVERY, SETTLING = 0.01, 0.15
"""s between two balances of forces, and until the first one, when the observer of pistons has settled; assumed."""

EAGER = 1.0
"""s; found by trial: so long a lane believes at once what is found, by which it holds a head that it would let fall. From then
on it does so while its motion moves, since at rest a model that changes stirs the head."""

FALLEN, RETURN = 0.3, 0.5
"""s and 1; found by trial (the second from 0.5 to 0.7, the first from 0.3 to 0.5 make no difference): from then on until
``EAGER`` is over a lane counts as so far in motion, so that its loop is stiffer. The rig as described lets some heads fall by
2 to 6 mm in the first 0.3 s; what is found brings them back, with the gain of rest only within another second."""

MARGIN = 3e-3
"""m; assumed: nearer to an end stop than that, its force may be among those of a balance."""

SLOW = 4e-3
"""m/s; assumed: a piston at this speed counts as sliding by half, by v^2/(v^2 + SLOW^2)."""

TRUST = 0.2
"""f; found by trial: of 0.03 to 0.25 the least with which what is measured beyond the true rig's model is nearly white."""

RICHER, STEP = 1.01, 1e-3
"""1: a supply and a step of an opening, of which differences are taken."""

CELLS, FLOW_ERROR = 30.0, 0.15
"""1; found by trial. The first multiplies the variance of a cell, since errors of the model last for some periods; the second
is what the model errs by, in units of a period's change."""

STIRRED, LEAST_ERROR = 1000.0, 1.0
"""Pa a period. A chamber that changes by less than the first says less, by the square of the ratio, because what leaks decides
then, and errs alike for seconds; found by trial. The second is what the model errs by at least; assumed."""

INDEX_FOUND, INDEX_SPREAD = 1.38, 0.05
"""1: polytropic index of chambers, whose walls are slower than their motion, and how far its logarithm may be off. Measured on
the plant: with its own parameters 1.4 leaves innovations whiter than 1.2 and 1.3. The spread is assumed."""

FORCE_ERROR, PULL_ERROR, SLIP_ERROR, LEVEL_ERROR, BALANCES = 3.0, 0.5, 0.7, 0.15, 40.0
"""Found by trial: standard deviations of forces, N, and of the specific force, m/s2, in a balance; of friction, in units of its
level, of the part that has no direction and of all; and in how many balances the errors are new ones."""

CERTAIN = 0.06
"""1; found by trial: a logarithm with this standard deviation is told in full, one with twice as much not at all."""

REACH = 2.0
"""Standard deviations of what rigs are; assumed: no rig is further from the one described."""

UNEVEN_FLOWS, UNEVEN_FORCES = 50.0, 10.0
"""1: what the variance of a measurement is at least, in units of that of what is expected of it; found by trial. The mean then
moves more slowly than what is believed follows it, about which slopes hold."""

MOST = 3.0
"""Standard deviations; assumed: no error counts for more."""


class RigFilter(Rows):
    """What is known of the rig."""

    mean = rows(SIZE, "1", "logarithm of a parameter over that described")
    told = rows(SIZE, "1", "what the law was told last")
    believed = rows(SIZE, "1", "what the law believes, which goes over to what it is told")
    covariance = rows(SIZE * SIZE, "1", "of the logarithms, row by row")
    sensitivity = rows(4 * OF_CHAMBER, "Pa", "of expected pressures, chamber by chamber, to the parameters they depend on")
    sense = rows(4, "1", "sensitivity of spools to the logarithm of their lag")
    pressure = rows(4, "Pa", "pressures as observed with what is believed")
    spool = rows(4, "1", "openings of the spools, likewise")
    first = rows(2 * BALANCE, "SI", "signals of both balances, low-passed once")
    second = rows(2 * BALANCE, "SI", "low-passed twice")
    third = rows(2 * BALANCE, "SI", "low-passed three times")
    score = rows(2 * SIZE, "1", "sums of slope error/variance, of chambers and then of balances, since they were read")
    information = rows(2 * SIZE, "1", "likewise of slope^2/variance")
    heeded = row("1", "1 where the law is told what is found, 0 where something else says what it is told")
    since = row("s", "since the last balance")
    age = row("s", "since the start")
    fresh = row("1", "1 at a new start")


@helper
def correct(filter_: RigFilter, i: int, kind: int, slope: Array, error: float, variance: float, uneven: float) -> None:
    """One scalar measurement of lane ``i``: ``error`` = ``slope`` (SIZE,) times what the mean is short of, and noise.

    ``kind`` is 0 for a chamber and 1 for a balance."""
    gain, spread = column(SIZE), variance
    for a in range(SIZE):
        gain[a] = 0.0
        for b in range(SIZE):
            gain[a] += filter_.covariance[SIZE * a + b, i] * slope[b]
        spread += (1.0 + uneven) * gain[a] * slope[a]
    error = max(-MOST * math.sqrt(spread), min(MOST * math.sqrt(spread), error))
    for a in range(SIZE):
        filter_.score[SIZE * kind + a, i] += slope[a] * error / variance
        filter_.information[SIZE * kind + a, i] += slope[a] * slope[a] / variance
        filter_.mean[a, i] += gain[a] / spread * error
        for b in range(SIZE):
            filter_.covariance[SIZE * a + b, i] -= gain[a] * gain[b] / spread


@helper
def read_chamber(
    filter_: RigFilter,
    i: int,
    chamber: int,
    opening: float,
    measured: float,
    joints: Joints,
    period: float,
    noise: float,
    p: Rig,
) -> None:
    """A pressure that was ``measured``, Pa, a period after its valve got an ``opening``; ``p`` is the rig believed."""
    cylinder, sign, valve = chamber // 2, 1.0 - 2.0 * (chamber % 2), valve_of(chamber, p)
    area_p, area_n = (p.area_p1, p.area_n1) if cylinder == 0 else (p.area_p2, p.area_n2)
    area, half = (area_p if chamber % 2 == 0 else area_n), (p.half_l1 if cylinder == 0 else p.half_l2)
    length, rate = max(half + sign * joints.position[cylinder, i], 0.0), sign * joints.speed[cylinder, i]
    pressure, index = filter_.pressure[chamber, i], p.index * exact.exp(filter_.believed[INDEX, i])

    kept = exact.exp(-period / p.tau)
    mean, away, sense = (1.0 - kept) * p.tau / period, filter_.spool[chamber, i] - opening, filter_.sense[chamber, i]
    opened, turned = opening + mean * away, (mean - kept) * away + mean * sense
    filter_.spool[chamber, i] = opening + kept * away
    filter_.sense[chamber, i] = kept * sense + kept * period / p.tau * away

    fill, drain = driving_flows(pressure, p)
    more, inverse, air = RICHER * p.supply, 1.0 / pressure, p.coldness
    richer = valves.driving_flow(more, 1.0 / more, air, pressure, inverse, air, p.rho0, p.critical, p.knee, p.laminar)
    supply = valves.edge_conductance(opened, valve.supply, p.conductance, p.leakage)
    exhaust = valves.edge_conductance(-opened, valve.exhaust, p.conductance, p.leakage)
    wider = valves.edge_conductance(opened + STEP, valve.supply, p.conductance, p.leakage) - supply
    narrower = valves.edge_conductance(-opened - STEP, valve.exhaust, p.conductance, p.leakage) - exhaust
    whole = length + p.dead_volume / area
    per_flow, air_share = period * index * p.gas * p.temperature / (area * whole), length / whole
    filled, pressed = per_flow * (supply * fill - exhaust * drain), -period * index * pressure * rate / whole
    filled = max(min(p.atmosphere - pressure, 0.0), min(max(p.supply - pressure, 0.0), filled))
    expected = max(pressure + filled + pressed, 0.5 * pressure)

    slope, psi, first = column(SIZE), filter_.sensitivity, OF_CHAMBER * chamber
    for a in range(SIZE):
        slope[a] = 0.0
    psi[first + ON_SUPPLY, i] += per_flow * supply * (richer - fill) / (RICHER - 1.0)
    psi[first + ON_BORE, i] += 2.0 * area_p / area * (pressed * (1.0 - air_share) - filled * air_share)
    psi[first + ON_LAG, i] += per_flow * (wider * fill - narrower * drain) / STEP * turned
    psi[first + ON_DEAD, i] -= (filled + pressed) * (1.0 - air_share)
    psi[first + ON_INDEX, i] += filled + pressed
    slope[SUPPLY], slope[BORE + cylinder] = psi[first + ON_SUPPLY, i], psi[first + ON_BORE, i]
    slope[LAG] = psi[first + ON_LAG, i]
    slope[DEAD], slope[INDEX] = psi[first + ON_DEAD, i], psi[first + ON_INDEX, i]
    error = measured - expected
    for a in range(SIZE):
        error += slope[a] * (filter_.believed[a, i] - filter_.mean[a, i])
    change = abs(filled) + abs(pressed)
    own, share = max(FLOW_ERROR * change, LEAST_ERROR), min(1.0, max(change, LEAST_ERROR) / STIRRED)
    correct(filter_, i, 0, slope, error, (CELLS * noise * noise + own * own) / (share * share), UNEVEN_FLOWS)
    filter_.pressure[chamber, i] = expected + TRUST * (measured - expected)
    for k in range(OF_CHAMBER):
        psi[first + k, i] *= 1.0 - TRUST


@helper
def remember(filter_: RigFilter, i: int, cylinder: int, signals: Array, share: float) -> None:
    """Low-passes the ``signals`` (BALANCE,) of a piston's balance three times."""
    first = BALANCE * cylinder
    for k in range(BALANCE):
        if filter_.fresh[i] > 0.0:
            filter_.first[first + k, i], filter_.second[first + k, i] = signals[k], signals[k]
            filter_.third[first + k, i] = signals[k]
        filter_.first[first + k, i] += share * (signals[k] - filter_.first[first + k, i])
        filter_.second[first + k, i] += share * (filter_.first[first + k, i] - filter_.second[first + k, i])
        filter_.third[first + k, i] += share * (filter_.second[first + k, i] - filter_.third[first + k, i])


@helper
def balance(filter_: RigFilter, i: int, cylinder: int, found: float, pressures: Array, described: Rig) -> None:
    """One balance of forces along piston 0 or 1; ``found``, m/s2, is what the observer adds to the specific force."""
    first, mean, slope = BALANCE * cylinder, filter_.mean, column(SIZE)
    hand, specific = filter_.third[first + HAND, i], filter_.third[first + SPECIFIC, i] + found
    speed, sliding = filter_.third[first + SPEED, i], filter_.third[first + SLIDING, i]
    difference = filter_.third[first + DIFFERENCE, i]
    own = described
    area, coulomb, viscous = (own.area_p1, own.fc1, own.fv1) if cylinder == 0 else (own.area_p2, own.fc2, own.fv2)
    pressed = dry_friction.level_at(cylinder, pressures, i, described) - coulomb
    mass = described.mass * exact.exp(mean[MASS, i])
    coulomb = coulomb * exact.exp(mean[COULOMB + cylinder, i])
    viscous = viscous * exact.exp(mean[VISCOUS + cylinder, i])
    area = area * exact.exp(2.0 * mean[BORE + cylinder, i])
    for a in range(SIZE):
        slope[a] = 0.0
    slope[MASS], slope[COULOMB + cylinder] = mass * specific, coulomb * sliding
    slope[VISCOUS + cylinder], slope[BORE + cylinder] = viscous * speed, -2.0 * area * difference
    level = coulomb + pressed
    error = hand - (mass * specific + level * sliding + viscous * speed - area * difference)
    slip, doubt, pull = SLIP_ERROR * level * max(0.0, 1.0 - abs(sliding)), LEVEL_ERROR * level, PULL_ERROR * mass
    variance = FORCE_ERROR * FORCE_ERROR + pull * pull + slip * slip + doubt * doubt
    correct(filter_, i, 1, slope, error, BALANCES * variance, UNEVEN_FORCES)


@helper
def write_rig(described: Rig, logarithms: Array, p: Rig) -> None:
    """Writes to ``p`` the rig whose parameters are those ``described`` times what ``logarithms`` (SIZE,) stand for."""
    for k in range(Rig.size):
        p.rows[k] = described.rows[k]
    heavier, richer = exact.exp(logarithms[MASS]), exact.exp(logarithms[SUPPLY])
    slower, larger = exact.exp(logarithms[LAG]), exact.exp(logarithms[DEAD])
    p.rows[at.MASS] *= heavier
    p.rows[at.INVERSE_MASS] /= heavier
    p.rows[at.INVERSE_MASS1] /= heavier
    p.rows[at.SUPPLY] *= richer
    p.rows[at.SOURCE] *= richer
    p.rows[at.INVERSE_SUPPLY] /= richer
    p.rows[at.TAU] *= slower
    p.rows[at.SPOOL_RATE] /= slower
    p.rows[at.SPOOL_RATE1] /= slower
    p.rows[at.DEAD_VOLUME] *= larger
    for k in range(2):
        wider = exact.exp(logarithms[BORE + k])
        rod = described.rows[at.AREA_P1 + CYLINDER * k] - described.rows[at.AREA_N1 + CYLINDER * k]
        p.rows[at.AREA_P1 + CYLINDER * k] *= wider * wider
        p.rows[at.AREA_N1 + CYLINDER * k] = p.rows[at.AREA_P1 + CYLINDER * k] - rod
        p.rows[at.PERIMETER1 + CYLINDER * k] *= wider
        p.rows[at.FC1 + CYLINDER * k] *= exact.exp(logarithms[COULOMB + k])
        p.rows[at.FV1 + CYLINDER * k] *= exact.exp(logarithms[VISCOUS + k])


@helper
def certain(logarithm: float, deviation: float) -> float:
    """What is told of a parameter that is found to be so, with this standard deviation."""
    return max(0.0, min(1.0, 2.0 - deviation / CERTAIN)) * logarithm


@helper
def bound(filter_: RigFilter, i: int, spread: Array) -> None:
    """Keeps what is found within what rigs are, whose standard deviations are ``spread`` (SIZE,)."""
    for a in range(INDEX):
        most = REACH * spread[a]
        filter_.mean[a, i] = max(-most, min(most, filter_.mean[a, i]))


@helper
def heed(filter_: RigFilter, i: int) -> None:
    """What lane ``i`` is told: what is found, as far as it is certain."""
    for a in range(INDEX):
        filter_.told[a, i] = certain(filter_.mean[a, i], math.sqrt(max(0.0, filter_.covariance[(SIZE + 1) * a, i])))
    filter_.told[INDEX, i] = filter_.mean[INDEX, i]


@helper
def tell(filter_: RigFilter, i: int, described: Rig, told: Array) -> None:
    """Writes the rig that lane ``i`` is told, rows (PARAMETERS, N)."""
    p, logarithms = Rig(column(Rig.size)), column(SIZE)
    for a in range(SIZE):
        logarithms[a] = filter_.told[a, i]
    write_rig(described, logarithms, p)
    for k in range(Rig.size):
        told[k, i] = p.rows[k]


def spread_of(rig: Parameters) -> Array:
    """Standard deviation (SIZE,) of the logarithms of ``TOLD`` about a rig as described, and of the index.

    Raises ``ValueError`` that names a parameter of zero, which has no logarithm."""
    for name in TOLD:
        if not value_of(rig, name) > 0.0:
            raise ValueError(f"{name} = {value_of(rig, name)!r} of a rig that is to be found; allowed: more than 0")
    logarithms = np.log([[value_of(rig, name), *ends] for name, ends in TOLD.items()])
    off, width = logarithms[:, 1:].mean(axis=1) - logarithms[:, 0], logarithms[:, 2] - logarithms[:, 1]
    return np.array([*np.sqrt(off * off + width * width / 12.0), INDEX_SPREAD])


def fresh(rig: Parameters) -> Array:
    """``RigFilter`` of a lane that begins."""
    spread, index = spread_of(rig), np.zeros(SIZE)
    index[INDEX] = np.log(INDEX_FOUND / rig.air.polytropic_index)
    covariance = np.diag(spread * spread).ravel()
    return RigFilter.lane(mean=index, told=index, believed=index, covariance=covariance, heeded=1.0, fresh=1.0, since=-SETTLING)


def found(filter_: RigFilter, rig: Parameters) -> dict[str, tuple[Array, Array]]:
    """Parameter -> its value in each lane, (N,), SI units, and the standard deviation of its logarithm, (N,), for a ``rig`` as
    described."""
    spread = np.sqrt(np.maximum(filter_.covariance[:: SIZE + 1], 0.0))
    return {name: (value_of(rig, name) * np.exp(filter_.mean[k]), spread[k]) for k, name in enumerate(TOLD)}
