"""What sensors add to what they measure, eliminated like start states: biases of pressure cells, and a field of the tracker.

A bias of 2 kPa is a force of 1 N, which moves a piston by a centimetre within a window. Metal nearby and a wrong scale bend
what a magnetic tracker shows, by millimetres over a workspace; on each axis that is a polynomial without a constant. Both are
known before to some ``electronics.pressure_bias`` and ``position_distortion``. Residuals are linear in them, so that every
evaluation solves for them (variable projection), and the search sees the parameters alone.
"""

from dataclasses import replace

import numpy as np
from numpy.polynomial import polynomial

from baselines.identification.starts import Noise, Slopes
from baselines.identification.windows import Windows
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.electronics import Electronics

POWERS = [(i, k - i) for k in (1, 2, 3) for i in range(k, -1, -1)]
"""Of x and y in each term of the field."""

REACH = 0.15
"""m; assumed: about as far as an experiment goes from where the tracker is registered."""

WIDER = 2.0
"""Standard deviation of a term over the field's RMS: a wave of 0.6 m has terms so large at ``REACH``."""

DEGREE, SAMPLES = 5, 4
"""Degree of a polynomial of time through a window's positions, and samples for each, at least. The field is taken there: at
noisy positions a field that shrinks the workspace would shrink the noise."""

LEAST = 1e-9
"""Pa and m: smaller errors are taken for this."""


class Offsets:
    """The errors in some ``windows``. ``sizes`` (E,) are in standard deviations of what is known before."""

    def __init__(self, windows: Windows, noise: Noise, board: Electronics) -> None:
        u, v = np.moveaxis((_smooth(windows) - (board.registration_x, board.registration_y)) / REACH, -1, 0)
        terms = max(WIDER * board.position_distortion, LEAST) * np.stack([u**i * v**k for i, k in POWERS], axis=-1)
        terms = np.where(windows.valid[..., None], terms, 0.0)
        count, cells = len(terms), 4
        field = np.einsum("wfe,ab->wfabe", terms, np.eye(2)).reshape(count, -1, 2 * len(POWERS))
        bias = np.tile(max(board.pressure_bias, LEAST) * np.eye(cells), (count, windows.length, 1))
        self._windows, self._bias, self._field = windows, bias, field
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
