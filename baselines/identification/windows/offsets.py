"""What sensors add to what they measure, eliminated like start states: biases of cells, a tracker's field, encoders' zeros.

A bias of 2 kPa is a force of 1 N, which moves a piston by a centimetre within a window. Metal nearby and a wrong scale bend
what a magnetic tracker shows, by millimetres over a workspace; on each axis that is a polynomial without a constant. Both are
known before to some ``electronics.pressure_bias`` and ``position_distortion``. An encoder's zero is off by some
``encoder_offset``. Residuals are linear in them, so that every
evaluation solves for them (variable projection), and the search sees the parameters alone.
"""

from dataclasses import replace

import numpy as np
from numpy.polynomial import polynomial

from baselines.identification.windows.encoders import POWERS, REACH, WIDER, slopes_of
from baselines.identification.windows.starts import Noise, Slopes
from baselines.identification.windows.windows import Windows
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

DEGREE, SAMPLES = 5, 4
"""Degree of a polynomial of time through a window's positions, and samples for each, at least. The field is taken there: at
noisy positions a field that shrinks the workspace would shrink the noise."""

LEAST = 1e-9
"""Pa and m: smaller errors are taken for this."""


class Offsets:
    """The errors in some ``windows``. ``sizes`` (E,) are in standard deviations of what is known before."""

    def __init__(self, windows: Windows, noise: Noise, rig: Parameters) -> None:
        board = rig.electronics
        u, v = np.moveaxis((_smooth(windows) - (board.registration_x, board.registration_y)) / REACH, -1, 0)
        terms = max(WIDER * board.position_distortion, LEAST) * np.stack([u**i * v**k for i, k in POWERS], axis=-1)
        terms = np.where(windows.valid[..., None], terms, 0.0)
        count, cells = len(terms), 4
        field = np.einsum("wfe,ab->wfabe", terms, np.eye(2)).reshape(count, -1, 2 * len(POWERS))
        if windows.trial.counted is not None:
            moved = slopes_of(windows.positions, rig) * windows.trial.counted
            field = np.where(windows.valid[..., None, None], moved, 0.0).reshape(count, -1, 2)
        bias = np.tile(max(board.pressure_bias, LEAST) * np.eye(cells), (count, windows.length, 1))
        self._windows, self._bias, self._field, self._board = windows, bias, field, board
        self._columns = np.zeros((count, bias.shape[1] + field.shape[1] + len(windows.free), cells + field.shape[2]))
        heard = windows.pressure_weights.reshape(count, -1, 1)
        seen = np.repeat(windows.position_weights, 2, axis=1)[..., None]
        self._columns[:, : bias.shape[1], :cells] = -heard * bias / noise.pressure
        self._columns[:, bias.shape[1] : -len(windows.free), cells:] = -seen * field / noise.position
        self.sizes: Array = np.zeros(self._columns.shape[2])

    @property
    def biases(self) -> Array:
        """What each pressure cell adds (4,), Pa."""
        return np.asarray(self._bias[0, :4] @ self.sizes[:4])

    @property
    def zeros(self) -> Array:
        """What the zeros of both encoders are off (2,), m; empty where a tracker sees the head."""
        known = self._windows.trial.counted
        return np.empty(0) if known is None else np.asarray(self.sizes[4:] * known)

    @property
    def distortion(self) -> float:
        """RMS of what a tracker's field moves the measured positions by, m, of one axis; 0 where encoders count them."""
        if self._windows.trial.counted is not None:
            return 0.0
        moved = (self._field @ self.sizes[4:]).reshape(self._windows.positions.shape)[self._windows.valid]
        return float(np.sqrt(np.mean(moved**2)))

    def bound(self, times: float) -> bool:
        """Make no error larger than so many ``times`` what is known of it before; whether one was."""
        before, most = self.sizes, times * max(self._board.position_distortion, LEAST)
        within = np.clip(before, -times, times)
        if self._windows.trial.counted is None:
            within[4:] = before[4:] * min(1.0, most / max(self.distortion, LEAST))
        self.sizes = within
        return not np.array_equal(before, within)

    def encoders(self, jacobian: Array, covariance: Array) -> tuple[Array, Array]:
        """What the zeros of both encoders are off (2,), m, and standard deviations (2,); none where a tracker sees the head.

        The last rows (E, Q) of a ``jacobian`` are those of ``sizes``; ``covariance`` (Q, Q) is that of the coordinates.
        """
        known = self._windows.trial.counted
        if known is None:
            return np.empty(0), np.empty(0)
        bent = jacobian[-len(self.sizes) :]
        every = np.diag(self._inverse + bent @ covariance @ bent.T)
        return self.zeros, np.sqrt(every[4:]) * known

    def corrected(self) -> Windows:
        """The windows as sensors without errors would have them."""
        pressures, positions = self._windows.pressures, self._windows.positions
        bias, moved = self._bias @ self.sizes[:4], self._field @ self.sizes[4:]
        pressures, positions = pressures - bias.reshape(pressures.shape), positions - moved.reshape(positions.shape)
        return replace(self._windows, pressures=pressures, positions=positions)

    def linearize(self, slopes: Slopes) -> None:
        """Take the start states' ``slopes`` for those of what follows."""
        self._left = slopes.unexplained(self._columns)
        tall = self._left.reshape(-1, self._left.shape[2])
        self._inverse = np.linalg.inv(tall.T @ tall + np.eye(tall.shape[1]))

    def step(self, residual: Array) -> float:
        """A Gauss-Newton step for residuals (W, R + F); its length in standard deviations."""
        gradient = np.einsum("wre,wr->e", self._left, residual) + self.sizes
        step = -self._inverse @ gradient
        self.sizes = self.sizes + step
        return float(np.sqrt(-gradient @ step))

    def unexplained(self, columns: Array) -> tuple[Array, Array]:
        """What the errors cannot explain of columns (W, R + F, Q), and the columns of their ``sizes`` as residuals, (E, Q)."""
        along = self._inverse @ np.tensordot(self._left, columns, axes=((0, 1), (0, 1)))
        return columns - self._left @ along, -along


def _smooth(windows: Windows) -> Array:
    """Positions (W, F, 2) without most of the noise."""
    places = windows.positions.copy()
    for when, valid, place in zip(windows.arrived / windows.length, windows.valid, places, strict=True):
        if valid.any():
            known = polynomial.polyfit(when[valid], place[valid], min(DEGREE, int(valid.sum()) // SAMPLES))
            place[valid] = polynomial.polyval(when[valid], known).T
    return places
