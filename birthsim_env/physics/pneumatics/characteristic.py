"""The characteristic of a valve: how much of its conductance the spool opens, and its inverse.

A spool has two metering edges: one to the supply, which opens at s > 0, and one to the exhaust, which opens at s < 0. Each
opens

    g = t (1 + c (1 - t)),  t = max(|s| - d, 0) / (1 - d)

of its conductance: nothing up to the overlap d, then in a curve that the curvature c bends, steeper at first where it is
positive, and 1 at full stroke. Kernels take an edge as the three numbers of the same parabola in tau = max(|s| - d, 0).

Two numbers, and no table of knots: they meet the catalogue of an MPYE-5-M5-010-B within 1.8 % of full flow, of which the maker
promises 10 %; the inverse is one root instead of a search, the slope has no steps that a gradient would see, and a lane keeps
three rows an edge. A measured table is fitted (``baselines.identification.valve_table``), which says how well the form fits.
"""

import math
from typing import Any, NamedTuple

from birthsim_env.physics.compiled.compilation import helper


class Edge(NamedTuple):
    """A metering edge, of which tau (``slope`` - ``bend`` tau) is open, in parts of the valve's conductance (``edge_of``)."""

    overlap: float
    slope: float
    bend: float


def edge_of(overlap: Any, curvature: Any, share: Any) -> Edge:
    """The edge with overlap d, curvature c and its own ``share`` of the valve's conductance; of arrays, edges side by side."""
    reach = 1.0 - overlap
    return Edge(overlap, share * (1.0 + curvature) / reach, share * curvature / (reach * reach))


@helper
def opened_part(opening: float, edge: Edge) -> float:
    """Part of the valve's conductance that is open at an ``opening`` in [-1, 1]; a negative one is the other edge's."""
    beyond = max(opening - edge.overlap, 0.0)
    return beyond * (edge.slope - edge.bend * beyond)


@helper
def largest_part(edge: Edge) -> float:
    """Part of the valve's conductance that is open at full stroke: the edge's share."""
    reach = 1.0 - edge.overlap
    return reach * (edge.slope - edge.bend * reach)


@helper
def _root(part: float, slope: float, bend: float) -> float:
    """The smaller tau with tau (``slope`` - ``bend`` tau) = ``part``, in the form that stays exact where nothing bends."""
    return 2.0 * part / max(slope + math.sqrt(max(slope * slope - 4.0 * bend * part, 0.0)), 1e-9)


@helper
def _crossed(part: float, crossing: float) -> float:
    """Part of the overlap that belongs to a ``part``: a parabola that ends level at ``crossing``."""
    left = max(1.0 - part / crossing, 0.0)
    return 1.0 - left * left


@helper
def opening_of(part: float, edge: Edge, crossing: float) -> float:
    """Opening in [0, 1] at which an edge opens a ``part``, at least 0, of the valve's conductance; 1 where it cannot.

    Below ``crossing`` not all of the overlap is added, so that a wish about zero does not throw the spool from side to side.
    What then leaves the valve is less than the wish, and catches up with it on the way to ``crossing``: the later, the more
    steeply, which loops answer by chatter. A ramp catches up later than this parabola.
    """
    most = largest_part(edge)
    beyond = _root(min(part, most), edge.slope, edge.bend)
    # By itself the root comes one rounding short of full stroke, at which laws see that a valve saturates.
    return min(beyond + edge.overlap * _crossed(part, crossing), 1.0) if part < most else 1.0


@helper
def common_opening(part: float, share: float, one: Edge, other: Edge, crossing: float) -> float:
    """Opening in [0, 1] at which two edges that open together give ``share`` of ``one`` and the rest of ``other``: ``part``."""
    is_first = one.overlap <= other.overlap
    first, second = (one, other) if is_first else (other, one)
    weight, lead = share if is_first else 1.0 - share, second.overlap - first.overlap
    begun = weight * (lead * (first.slope - first.bend * lead))
    alone = part < begun
    start = first.overlap if alone else second.overlap
    slope = weight * first.slope if alone else second.slope + weight * (first.slope - 2.0 * first.bend * lead - second.slope)
    bend = weight * first.bend if alone else second.bend + weight * (first.bend - second.bend)
    reach, rest = 1.0 - start, part if alone else part - begun
    most = reach * (slope - bend * reach)
    beyond = _root(min(rest, most), slope, bend)
    opened = beyond + (start - first.overlap) + first.overlap * _crossed(part, crossing)
    return max(0.0, min(1.0, opened)) if rest < most else 1.0
