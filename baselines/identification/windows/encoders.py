"""Encoders at the rods in a log: how the linkage's end follows them, and what a tracker in the same log says of their zeros."""

from dataclasses import dataclass

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import end_effector, inverse_geometry
from birthsim_env.physics.rig.parameters import Parameters

STEP = 1e-6
"""m of the differences."""

POWERS = [(i, k - i) for k in (1, 2, 3) for i in range(k, -1, -1)]
"""Of x and y in each term of a tracker's field."""

REACH = 0.15
"""m; assumed: about as far as an experiment goes from where the tracker is registered."""

WIDER = 2.0
"""Standard deviation of a term over the field's RMS: a wave of 0.6 m has terms so large at ``REACH``."""

LAGS = 1e-3 * np.arange(0.0, 31.0)
"""s; latencies of the tracker behind the encoders that are tried."""


def slopes_of(positions: Array, rig: Parameters) -> Array:
    """How the end effector's positions (..., 2) follow those of both pistons, (..., 2, 2)."""
    places = positions.reshape(-1, 2).T
    # Where nothing was measured positions are 0, which no linkage reaches.
    known = np.hypot(*places) > 1e-6
    found = np.zeros((places.shape[1], 2, 2))
    pistons = inverse_geometry(np.ascontiguousarray(places[:, known]), rig)
    for k in range(2):
        moved = [end_effector(pistons + sign * STEP * np.eye(2)[:, [k]], rig) for sign in (1.0, -1.0)]
        found[known, :, k] = (moved[0] - moved[1]).T / (2.0 * STEP)
    return found.reshape(*positions.shape, 2)


@dataclass(frozen=True)
class Zeros:
    """What encoders' zeros are off, ``offset`` (2,), m, and standard deviations (2,); the ``latency``, s, of the tracker behind
    the encoders with which both agree best."""

    offset: Array
    deviation: Array
    latency: float

    def words(self) -> str:
        """What the encoders are off, in a line."""
        parts = [f"{1e3 * off:.3g} +- {2e3 * own:.2g} mm" for off, own in zip(self.offset, self.deviation, strict=True)]
        return (
            f"by the tracker, {1e3 * self.latency:.3g} ms later than they, the encoders count {parts[0]} (cylinder 1) and "
            f"{parts[1]} (cylinder 2) too much; taken off"
        )


def zeros_by_tracker(times: Array, pistons: Array, tracked: Array, rig: Parameters) -> Zeros:
    """The zeros of encoders that counted ``pistons`` (2, T), by the positions (2, T) that a tracker showed.

    Least squares over the offsets and the tracker's field, each with what is known of it before, for the best of ``LAGS``.
    """
    known = np.isfinite(pistons).all(axis=0) & np.isfinite(tracked).all(axis=0)
    fresh = np.append(False, np.any(np.diff(tracked, axis=1) != 0, axis=0)) & known
    rows, board = np.flatnonzero(fresh), rig.electronics
    counted = np.array([np.interp(times, times[known], one[known]) for one in pistons])
    u, v = (tracked[:, rows] - np.transpose([(board.registration_x, board.registration_y)])) / REACH
    field = max(WIDER * board.position_distortion, 1e-9) * np.stack([u**i * v**k for i, k in POWERS], axis=-1)
    terms = np.einsum("te,ab->tabe", field, np.eye(2)).reshape(2 * len(rows), -1)
    best: tuple[float, Array, Array, float] | None = None
    for lag in LAGS:
        then = np.array([np.interp(times[rows] - lag, times, one) for one in counted])
        ends = end_effector(then, rig)
        # The tracker shows J (y - offset) and its field, where encoders count y.
        columns = np.hstack([-(slopes_of(ends.T, rig) * board.encoder_offset).reshape(2 * len(rows), 2), terms])
        missed = (tracked[:, rows] - ends).T.ravel()
        noise = max(float(np.std(missed - columns @ np.linalg.lstsq(columns, missed, rcond=None)[0])), 1e-7)
        normal = columns.T @ columns / noise**2 + np.eye(columns.shape[1])
        sizes = np.linalg.solve(normal, columns.T @ missed / noise**2)
        if best is None or noise < best[0]:
            deviation = np.sqrt(np.diag(np.linalg.inv(normal))[:2])
            best = noise, sizes[:2] * board.encoder_offset, deviation * board.encoder_offset, float(lag)
    assert best is not None, "some latencies are tried"
    return Zeros(*best[1:])
