"""What helpers do beside arithmetic: rings of rows, loops of computed length, guarded divisions, random numbers."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from birthsim_env.gradients import source
from birthsim_env.gradients.derivatives import reverse
from birthsim_env.gradients.graph import Graph
from birthsim_env.gradients.symbols import empty, inputs
from birthsim_env.gradients.tracing import UntraceableError, call
from birthsim_env.parts.sensors import tracker
from birthsim_env.parts.sensors.noise import normal
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

LANES = 24


@helper
def ring(x: Array, out: Array, n: int) -> None:
    """Rows: slot, two new values, and a ring of four pairs; the values go in, and the pair before the last comes out."""
    for i in range(n):
        kept, slot = x[3:], (int(x[0, i]) + 1) % 4
        for k in range(2):
            kept[2 * slot + k, i] = x[1 + k, i] * kept[2 * slot + k, i]
            out[k, i] = kept[2 * slot + k, i] + 3.0 * kept[2 * ((slot - 2) % 4) + k, i]
        out[2, i] = kept[0, i] + 2.0 * kept[7, i]


@helper
def queued(x: Array, out: Array, n: int) -> None:
    """Rows: time, x, y, and three samples of three rows."""
    queue = x[3:].reshape((3, 3, -1))
    for i in range(n):
        tracker.take(queue, i, x[0, i], 240.0, x[1, i], x[2, i])
        for k in range(3):
            out[k, i] = queue[k, 0, i] * queue[k, 1, i]


@helper
def guarded(x: Array, out: Array, n: int) -> None:
    """Rows: a divisor, which may be zero, a factor and a count."""
    for i in range(n):
        out[0, i], out[1, i] = x[1, i], 0.0
        for _ in range(int(min(x[2, i], 3.0))):
            out[0, i] = out[0, i] * x[1, i]
        if x[0, i] <= 0.0:
            continue
        out[1, i] = x[1, i] ** 3 / x[0, i] ** 2


@helper
def noisy(x: Array, out: Array, n: int) -> None:
    """Rows: a key, a tick and a number that scales noise."""
    for i in range(n):
        out[0, i] = x[2, i] * x[2, i] * normal(x[0].view(np.uint64)[i], int(x[1, i]), 3)


@helper
def endless(x: Array, out: Array, n: int) -> None:
    for i in range(n):
        out[0, i] = 0.0
        for _ in range(int(x[0, i])):
            out[0, i] += x[0, i]


def generated(function: Any, rows: int, count: int) -> str:
    """A module with the gradient of what a helper writes to ``count`` rows."""
    graph, out = Graph(), empty(count)
    block = inputs(graph, "a", rows)
    call(function, block, out, 1)
    pairs = [(value, graph.input("b", k)) for k, value in enumerate(out[:, 0])]
    bars = reverse(graph, pairs, [graph.input("a", row) for row in range(rows)])
    return source.HEAD + source.loop(graph, "back", ("a", "b", "o"), [("o", k, bar) for k, bar in enumerate(bars)])


def gradient(function: Any, x: Array, weights: Array) -> Array:
    """Gradient of the sum of weights times what a helper writes, by the code that is generated for it."""
    found = np.empty_like(x)
    source.module_of(generated(function, len(x), len(weights))).back(x, weights, found, x.shape[1])
    return found


def columns(*rows: Any) -> Array:
    return np.stack([np.broadcast_to(np.asarray(row, dtype=np.float64), LANES) for row in rows])


def rows_of(count: int) -> Array:
    return np.random.default_rng(count).uniform(0.5, 1.5, (count, LANES))


KEYS = np.random.default_rng(1).integers(2**64, size=LANES, dtype=np.uint64).view(np.float64)
CASES: dict[str, tuple[Callable[..., None], Array, int, int]] = {
    "a ring": (ring, np.concatenate([columns(np.arange(LANES) % 4), rows_of(10)]), 3, 1),
    "samples": (queued, np.concatenate([columns(np.arange(LANES) / 240.0), rows_of(11)]), 3, 1),
    "guards": (guarded, columns(np.arange(LANES) % 3, rows_of(1)[0], np.arange(LANES) % 5 + 0.5), 2, 0),
    "noise": (noisy, np.concatenate([columns(KEYS, np.arange(LANES)), rows_of(1)]), 1, 2),
}
"""A helper, rows of its lanes, rows that it writes, and the first row to which a difference is taken."""


@pytest.mark.parametrize("name", CASES)
def test_gradients_of_a_helper_are_differences(name: str) -> None:
    function, x, count, first = CASES[name]
    weights = np.random.default_rng(2).standard_normal((count, LANES))
    way = np.random.default_rng(3).standard_normal(x.shape)
    way[:first] = 0.0
    if name == "guards":
        way[0], way[2] = np.where(x[0] > 0.0, way[0], 0.0), 0.0

    def total(size: float) -> Array:
        out = np.empty((count, LANES))
        function(np.where(way == 0.0, x, x + size * way), out, LANES)
        return (weights * out).sum(axis=0)

    found = gradient(function, x, weights)
    assert np.isfinite(found[first:]).all()
    got = np.where(way == 0.0, 0.0, found * way).sum(axis=0)
    np.testing.assert_allclose(got, (total(1e-5) - total(-1e-5)) / 2e-5, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("name", CASES)
def test_generated_code_has_the_bits_of_python(name: str) -> None:
    """Its statements become instructions one by one, without Numba's analysis."""
    function, x, count, _ = CASES[name]
    weights = np.random.default_rng(2).standard_normal((count, LANES))
    names: dict[str, Any] = {}
    text = generated(function, len(x), count).replace("@straight", "").replace("@helper", "")
    exec(text, names)
    names["choose"] = lambda condition, yes, no: yes if condition else no
    expected = np.empty_like(x)
    with np.errstate(all="ignore"):
        names["back"](x, weights, expected, LANES)
    np.testing.assert_array_equal(gradient(function, x, weights), expected)


def test_a_loop_of_any_length_is_refused() -> None:
    with pytest.raises(UntraceableError, match="min"):
        gradient(endless, columns(3.0), np.ones((1, LANES)))


@helper
def converted(x: Array, out: Array, n: int) -> None:
    for i in range(n):
        out[0, i] = max(-1.0, min(1.0, exact.rounded(x[0, i], 0.25)))


def test_what_a_converter_rounds_passes_as_it_is() -> None:
    """Within its range, beyond which nothing passes; its value is rounded."""
    x, out = np.array([[-2.0, -0.6, 0.1, 0.126, 0.7, 1.2]]), np.empty((1, 6))
    converted(x, out, 6)
    np.testing.assert_array_equal(out, [[-1.0, -0.5, 0.0, 0.25, 0.75, 1.0]])
    np.testing.assert_array_equal(gradient(converted, x, np.full((1, 6), 3.0)), [[0.0, 3.0, 3.0, 3.0, 3.0, 0.0]])
