"""Quadratic programmes with bounds, lane by lane in step: a primal active-set method. Other lanes change no bit of one.

    minimise u' H u / 2 + c' u,  low <= u <= high

Projected Gauss-Seidel sweeps guess which flows end at a bound. Then the free ones take Newton's step up to the first bound,
where that flow stays; once a step is whole, all flows at a bound away from which the sum falls are free again. The sum never
grows (More and Toraldo 1991, SIAM Journal on Optimization 1:93, guess the bounds by gradients instead).
"""

import math

from baselines.rivals.horizon import FLOWS, HALF, SIZE, place
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

SWEEPS, ROUNDS = 6, 40
"""A sweep costs a fifth of a round. From the plan of the period before one to three rounds are enough; bounds that no plan
before has met took up to 31."""

EXACT = 1e-10
"""Of the largest slope, what is none."""

LARGEST, BUSY, LENGTH, WRONG, SUM, LANE = range(6)
"""Rows of a lane's scratch: the largest slope; 1 while it is not done; what it takes of Newton's step; 1 where a bound is
wrong; a slope; how many they are."""


@helper
def slope(h: Array, u: Array, c: Array, out: Array, n: int) -> None:
    """``out`` (SIZE, n) is H u + c."""
    for row in range(SIZE):
        for i in range(n):
            out[row, i] = c[row, i]
        for column in range(SIZE):
            entry = place(max(row, column), min(row, column))
            for i in range(n):
                out[row, i] += h[entry, i] * u[column, i]


@helper
def _factor(h: Array, free: Array, factor: Array, n: int) -> None:
    """Cholesky's factor of H among the ``free``; the diagonal has the inverses."""
    for row in range(SIZE):
        for column in range(row + 1):
            entry = place(row, column)
            for i in range(n):
                both = free[row, i] * free[column, i]
                factor[entry, i] = both * h[entry, i] + (1.0 - both if row == column else 0.0)
            for k in range(column):
                first, second = place(row, k), place(column, k)
                for i in range(n):
                    factor[entry, i] -= factor[first, i] * factor[second, i]
            diagonal = place(column, column)
            for i in range(n):
                if row == column:
                    factor[entry, i] = 1.0 / math.sqrt(factor[entry, i])
                else:
                    factor[entry, i] *= factor[diagonal, i]


@helper
def _solve(factor: Array, d: Array, n: int) -> None:
    """Solves for ``d`` (SIZE, n) in place."""
    for row in range(SIZE):
        for k in range(row):
            entry = place(row, k)
            for i in range(n):
                d[row, i] -= factor[entry, i] * d[k, i]
        for i in range(n):
            d[row, i] *= factor[place(row, row), i]
    for back in range(SIZE):
        row = SIZE - 1 - back
        for k in range(row + 1, SIZE):
            entry = place(k, row)
            for i in range(n):
                d[row, i] -= factor[entry, i] * d[k, i]
        for i in range(n):
            d[row, i] *= factor[place(row, row), i]


@helper
def _sweep(h: Array, c: Array, low: Array, high: Array, u: Array, lane: Array, n: int) -> None:
    """Each flow in turn to its best, the others as they are."""
    for row in range(SIZE):
        for i in range(n):
            lane[SUM, i] = c[row, i]
        for column in range(SIZE):
            entry = place(max(row, column), min(row, column))
            for i in range(n):
                lane[SUM, i] += h[entry, i] * u[column, i]
        for i in range(n):
            best = u[row, i] - lane[SUM, i] / h[place(row, row), i]
            u[row, i] = max(low[row % FLOWS, i], min(high[row % FLOWS, i], best))


@helper
def _free(low: Array, high: Array, u: Array, g: Array, free: Array, lane: Array, n: int) -> None:
    """Frees flows at a bound that they do not press against, in lanes whose step was whole; ``WRONG`` says where any was."""
    for i in range(n):
        lane[WRONG, i] = 0.0
    for row in range(SIZE):
        for i in range(n):
            none = EXACT * lane[LARGEST, i]
            stays = (u[row, i] <= low[row % FLOWS, i] and g[row, i] >= -none) or (
                u[row, i] >= high[row % FLOWS, i] and g[row, i] <= none
            )
            if free[row, i] == 0.0 and not stays and lane[BUSY, i] > 0.0 and lane[LENGTH, i] >= 1.0:
                free[row, i], lane[WRONG, i] = 1.0, 1.0


@helper
def _step(low: Array, high: Array, u: Array, d: Array, free: Array, lane: Array, n: int) -> None:
    """Takes ``d`` up to the first bound; what meets it is no longer free."""
    for i in range(n):
        lane[LENGTH, i] = 1.0
    for row in range(SIZE):
        for i in range(n):
            bound = high[row % FLOWS, i] if d[row, i] > 0.0 else low[row % FLOWS, i]
            room = (bound - u[row, i]) / d[row, i] if d[row, i] != 0.0 else 1.0
            lane[LENGTH, i] = min(lane[LENGTH, i], room)
    for row in range(SIZE):
        for i in range(n):
            length = lane[LENGTH, i]
            bound = high[row % FLOWS, i] if d[row, i] > 0.0 else low[row % FLOWS, i]
            room = (bound - u[row, i]) / d[row, i] if d[row, i] != 0.0 else 1.0
            there = max(low[row % FLOWS, i], min(high[row % FLOWS, i], u[row, i] + length * d[row, i]))
            if lane[BUSY, i] > 0.0:
                met = d[row, i] != 0.0 and room <= length and length < 1.0
                u[row, i], free[row, i] = bound if met else there, 0.0 if met else free[row, i]


@helper
def minimise(h: Array, c: Array, low: Array, high: Array, u: Array, n: int) -> None:
    """Improves ``u`` (SIZE, n) to the least sum within bounds (FLOWS, n), which repeat; ``h`` (HALF, n), ``c`` (SIZE, n)."""
    g, free, d, factor, lane = scratch(SIZE), scratch(SIZE), scratch(SIZE), scratch(HALF), scratch(LANE)
    for row in range(SIZE):
        for i in range(n):
            u[row, i] = max(low[row % FLOWS, i], min(high[row % FLOWS, i], u[row, i]))
    for _ in range(SWEEPS):
        _sweep(h, c, low, high, u, lane, n)
    slope(h, u, c, g, n)
    for i in range(n):
        lane[LARGEST, i], lane[BUSY, i], lane[LENGTH, i] = 0.0, 1.0, 1.0
    for row in range(SIZE):
        for i in range(n):
            free[row, i] = 1.0 if low[row % FLOWS, i] < u[row, i] and u[row, i] < high[row % FLOWS, i] else 0.0
            lane[LARGEST, i] = max(lane[LARGEST, i], abs(c[row, i]))
    _free(low, high, u, g, free, lane, n)
    for _ in range(ROUNDS):
        for row in range(SIZE):
            for i in range(n):
                d[row, i] = -free[row, i] * g[row, i]
        _factor(h, free, factor, n)
        _solve(factor, d, n)
        _step(low, high, u, d, free, lane, n)
        slope(h, u, c, g, n)
        _free(low, high, u, g, free, lane, n)
        left = 0.0
        for i in range(n):
            done = lane[LENGTH, i] >= 1.0 and lane[WRONG, i] == 0.0
            lane[BUSY, i] = 0.0 if done else lane[BUSY, i]
            left += lane[BUSY, i]
        if left == 0.0:
            break
