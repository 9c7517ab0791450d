"""What a rig is, by a recurrent network that was taught with simulated rigs: it corrects what ``rig_filter`` finds.

At every balance of forces it sees, of each parameter that a kind of measurement depends on,
    z = score/sqrt(information + 1)   and   log(1 + information)
since the last one, where score and information are sums of slope error/variance and slope^2/variance over measurements that
are a control period apart; what the filter has found and how sure it is; what the law believes; and how far the target moves.
For each parameter it says by how much the filter errs and how sure it is itself, in units of the spread of rigs,
    found = mean + spread FAR said,   log(deviation) = log(deviation of the filter) + SURE said.
A filter takes its errors for new ones at every measurement, but slopes, leaks and laws of friction err alike for seconds. What
follows from that the network learned.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.estimation.rig_filter import (
    BORE,
    COULOMB,
    DEAD,
    INDEX,
    LAG,
    MASS,
    REACH,
    SIZE,
    SUPPLY,
    TOLD,
    VISCOUS,
    RigFilter,
    certain,
    spread_of,
)
from baselines.network import PolicyNetwork, answer
from birthsim_env.loop.stage import TABLE, singles, table3
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, rows
from birthsim_env.physics.rig.parameters import Parameters, value_of

READ = len(TOLD)
"""Parameters that are read: all but the index of chambers."""

OF_CHAMBERS = (SUPPLY, BORE, BORE + 1, LAG, DEAD, INDEX)
OF_BALANCES = (MASS, COULOMB, COULOMB + 1, VISCOUS, VISCOUS + 1, BORE, BORE + 1)
"""Parameters that a chamber's pressure and a balance of forces depend on."""

SUMS = np.array([*OF_CHAMBERS, *(SIZE + a for a in OF_BALANCES)])
"""Their places among ``RigFilter.score`` and ``RigFilter.information``."""

INPUTS = 2 * len(SUMS) + 2 * SIZE + READ + 1
"""Length of what the network sees."""

FAR, SURE = 4.0, 5.0
"""1: what an answer of 1 stands for, in spreads of rigs and in the logarithm of a deviation; assumed: few are as large."""

LEAST_DEVIATION = 1e-4
"""1: below it the filter's own deviation counts as this; assumed."""

LAYERS = 2
"""Of the network, with its memory between them."""

FIRST_TABLE = 2
"""Tables: what is seen (N, INPUTS), ``PolicyNetwork.room``, and from here on ``PolicyNetwork.tables``."""


class RigReader(Rows):
    """What the network has said of the rig."""

    said = rows(2 * READ, "1", "its last answer: where the filter errs, and how sure it is itself")
    mean = rows(READ, "1", "logarithm of a parameter over that described")
    deviation = rows(READ, "1", "standard deviation of that logarithm")
    cells = rows(0, "1", "the network's memory")


@helper
def look(filter_: RigFilter, i: int, moved: float, spread: Array, observed: NDArray[np.float32]) -> None:
    """Writes what the network sees of lane ``i`` to ``observed`` (INPUTS,), and lets the sums begin anew.

    ``moved`` is how far the target moves, 0 to 1, and ``spread`` (SIZE,) that of rigs."""
    count, place = SUMS.shape[0], 2 * SUMS.shape[0]
    for k in range(count):
        a = SUMS[k]
        score, information = filter_.score[a, i], filter_.information[a, i]
        observed[k] = score / math.sqrt(information + 1.0)
        observed[count + k] = exact.log(1.0 + information)
        filter_.score[a, i], filter_.information[a, i] = 0.0, 0.0
    for a in range(SIZE):
        unsure = math.sqrt(max(LEAST_DEVIATION * LEAST_DEVIATION, filter_.covariance[(SIZE + 1) * a, i]))
        observed[place + a] = filter_.mean[a, i] / spread[a]
        observed[place + SIZE + a] = exact.log(unsure / spread[a])
    for a in range(READ):
        observed[place + 2 * SIZE + a] = filter_.believed[a, i] / spread[a]
    observed[place + 2 * SIZE + READ] = moved


@helper
def read(reader: RigReader, filter_: RigFilter, i: int, moved: float, spread: Array, tables: int, lane: int) -> None:
    """Reads the rig of lane ``i``, which is ``lane`` in the tables."""
    observed, space = singles(tables, 0)[lane : lane + 1], table3(tables, 1)[:, lane : lane + 1]
    look(filter_, i, moved, spread, observed[0])
    said = reader.said[:, i : i + 1].T
    answer(tables + FIRST_TABLE * TABLE * 8, LAYERS, False, observed, space, reader.cells[:, i : i + 1].T, said)
    for a in range(READ):
        unsure = math.sqrt(max(LEAST_DEVIATION * LEAST_DEVIATION, filter_.covariance[(SIZE + 1) * a, i]))
        found, most = filter_.mean[a, i] + spread[a] * FAR * reader.said[a, i], REACH * spread[a]
        reader.mean[a, i] = max(-most, min(most, found))
        reader.deviation[a, i] = min(spread[a], unsure * exact.exp(SURE * reader.said[READ + a, i]))


@helper
def heed(reader: RigReader, filter_: RigFilter, i: int) -> None:
    """What lane ``i`` is told: what is read, as far as the filter or the network is certain.

    The network is the more honest of the two, but what it alone calls certain comes late: the parameters of a filter that errs
    fit together, so that its lanes are held sooner and more calmly by them than by those described."""
    for a in range(READ):
        unsure = math.sqrt(max(0.0, filter_.covariance[(SIZE + 1) * a, i]))
        filter_.told[a, i] = certain(reader.mean[a, i], min(unsure, reader.deviation[a, i]))
    filter_.told[INDEX, i] = filter_.mean[INDEX, i]


def fresh(rig: Parameters, network: PolicyNetwork) -> Array:
    """``RigReader`` of a lane that begins."""
    return np.concatenate([RigReader.lane(deviation=spread_of(rig)[:READ]), np.zeros(network.cells)])


def found(reader: RigReader, rig: Parameters) -> dict[str, tuple[Array, Array]]:
    """Parameter -> its value in each lane, (N,), SI units, and the standard deviation of its logarithm, (N,), for a ``rig`` as
    described."""
    return {name: (value_of(rig, name) * np.exp(reader.mean[k]), reader.deviation[k].copy()) for k, name in enumerate(TOLD)}


def tables(network: PolicyNetwork, lanes: int) -> tuple[Any, ...]:
    """What ``read`` needs for so many lanes."""
    return np.zeros((lanes, INPUTS), dtype=np.float32), network.room(lanes), *network.tables
