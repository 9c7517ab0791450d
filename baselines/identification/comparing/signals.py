"""The signals in which a model is judged, and what it is off in each.

They are what the log's sensors show: the pressure of each chamber, and x and y of the end effector, or the positions of the
pistons where encoders count them; on a rail that of the only piston.
"""

from dataclasses import dataclass

import numpy as np

from baselines.identification.log.log_columns import CHAMBERS, PISTONS, POSITIONS
from baselines.identification.log.trial import Trial, fresh_rows
from baselines.identification.windows.noise import LEAST, cell_noises, noise_of
from baselines.identification.windows.windows import Windows
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.linkage.inverse_kinematics import pistons_at
from birthsim_env.physics.rig.parameters import Parameters


@dataclass(frozen=True)
class Signal:
    """A column of a log: its ``noise``, as neighbouring samples show it, and its ``motion``, the standard deviation of what the
    log has of it, both in ``unit``."""

    name: str
    unit: str
    noise: float
    motion: float


@dataclass(frozen=True)
class Track:
    """A ``signal`` in W windows of N samples: ``times`` (W, N), s of the log, what was ``measured`` (W, N), and its ``error``
    (W, N), by how much it is more than the model shows; NaN where nothing was measured."""

    signal: Signal
    times: Array
    measured: Array
    error: Array

    @property
    def off(self) -> Array:
        """RMS of the error of each window (W,): NaN where nothing was measured, infinite where the model shows no numbers."""
        known = np.isfinite(self.measured)
        count = known.sum(axis=1)
        square = np.sum(np.where(known, np.nan_to_num(np.abs(self.error), nan=np.inf), 0.0) ** 2, axis=1)
        return np.sqrt(np.where(count > 0, square / np.maximum(count, 1), np.nan))


@dataclass(frozen=True)
class SignalError:
    """What a model is off in a ``signal``: ``rms``, and the ``largest`` error, which is shown ``at`` a time of the log, s."""

    signal: Signal
    rms: float
    largest: float
    at: float

    @property
    def share(self) -> float:
        """RMS over the standard deviation of what the log has."""
        return self.rms / self.signal.motion if self.signal.motion else float("inf")

    @property
    def over_noise(self) -> float:
        """RMS over the noise."""
        return self.rms / self.signal.noise


def shown_by(trial: Trial, rig: Parameters, pressures: Array, positions: Array) -> dict[str, Array]:
    """Signals (...) by name from pressures (..., 4) and positions of the end effector (..., 2)."""
    topology = trial.topology
    found = {topology.name_of(f"pressures_{CHAMBERS[k]}"): pressures[..., k] for k in topology.chambers}
    if trial.counted is None:
        return found | {name: positions[..., axis] for axis, name in enumerate(POSITIONS)}
    pistons = pistons_of(positions, rig)
    names = PISTONS if len(topology.cylinders) > 1 else ("", "position")
    return found | {names[k]: pistons[..., k] for k in topology.cylinders}


def pistons_of(positions: Array, rig: Parameters) -> Array:
    """Both pistons (..., 2), m from mid stroke, where the end effector is at positions (..., 2); NaN where these are none."""
    places = positions.reshape(-1, 2).T
    known = np.hypot(*places) > 1e-6  # where nothing was measured it is 0 or NaN
    joints = np.empty((4, int(known.sum())))
    pistons_at(np.concatenate([places[:, known], np.zeros_like(joints[:2])]), Rig(parameter_column(rig)), joints)
    found = np.full(places.shape, np.nan)
    found[:, known] = joints[:2]
    return found.T.reshape(positions.shape)


def signals_of(trial: Trial, rig: Parameters) -> tuple[Signal, ...]:
    """Those of a trial."""
    fresh = fresh_rows(trial.positions)
    values = shown_by(trial, rig, trial.pressures.T, trial.positions.T)
    cells = iter(cell_noises(trial)[list(trial.topology.chambers)])
    found = []
    for name, own in values.items():
        if name.startswith("pressures"):
            found.append(Signal(name, "Pa", float(next(cells)), float(np.nanstd(own))))
        else:
            noise = max(noise_of(own[None, fresh]), LEAST.position)
            found.append(Signal(name, "m", noise, float(np.nanstd(own[fresh]))))
    return tuple(found)


def tracks_of(
    windows: Windows, rig: Parameters, signals: tuple[Signal, ...], pressures: Array, positions: Array
) -> tuple[Track, ...]:
    """What was measured in windows beside predicted pressures (W, K, 4), Pa, and positions (W, F, 2), m."""
    trial = windows.trial
    heard, seen = windows.pressure_weights > 0, windows.position_weights[..., None] > 0
    measured = shown_by(trial, rig, np.where(heard, windows.pressures, np.nan), np.where(seen, windows.positions, np.nan))
    predicted = shown_by(trial, rig, pressures, positions)
    rows = windows.starts[:, None] + np.arange(windows.length)
    arrived = np.minimum(windows.starts[:, None] + windows.arrived, len(trial.times) - 1)
    found = []
    for signal in signals:
        when = trial.times[rows if signal.unit == "Pa" else arrived]
        own = measured[signal.name]
        found.append(Track(signal, when, own, own - predicted[signal.name]))
    return tuple(found)


def error_of(track: Track) -> SignalError:
    """RMS and largest error of all windows of a track; infinite where the model shows no numbers."""
    known = np.isfinite(track.measured)
    if not known.any():
        return SignalError(track.signal, float("nan"), float("nan"), float("nan"))
    error, times = np.nan_to_num(np.abs(track.error[known]), nan=np.inf), track.times[known]
    first = int(np.argmax(error))
    return SignalError(track.signal, float(np.sqrt(np.mean(error**2))), float(error[first]), float(times[first]))


def scores_of(tracks: tuple[Track, ...]) -> Array:
    """Mean square of the error over the noise of each window (W,), in which every signal counts alike."""
    every = np.array([(track.off / track.signal.noise) ** 2 for track in tracks])
    known = ~np.isnan(every)
    return np.asarray(np.where(known, every, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1))
