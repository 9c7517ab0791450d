"""A log beside its twin as a recording that the page plays: first the log, and as the rig beside it the model in free run.

The target of both is the position of the head in the log. The error that the page shows for the second rig is therefore that of
the model. Between two samples of the log both are interpolated linearly.
"""

from pathlib import Path

import numpy as np

from baselines.identification.comparing.compared import Compared
from baselines.identification.comparing.signals import Track, pistons_of
from baselines.identification.log.log_columns import CHAMBERS, PISTONS, POSITIONS
from baselines.identification.log.trial import Trial
from birthsim_env import __version__
from birthsim_env.files import whole_file
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import end_effector
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs.recording import COLUMNS, EVERY, FIELDS, FORMAT, SLICES, packed

MOST = 100_000
"""Most rows of a file, which then has a quarter of the size that the page reads; longer logs have rows farther apart."""


def write_twin(one: Compared, trial: Trial, path: Path) -> None:
    """Write the free run of a rig beside the log that a ``trial`` holds."""
    run = one.free
    lasted = min(float(track.times[np.isfinite(track.measured)][-1]) for track in run.tracks) - run.start
    interval = max(EVERY * trial.period, lasted / MOST)
    times: Array = run.start + interval * np.arange(int(lasted / interval + 1e-9) + 1, dtype=np.float64)
    log, twin = ({track.signal.name: _at(track, times, part) for track in run.tracks} for part in (0.0, 1.0))
    rows = np.full((len(times), 2 * COLUMNS), np.nan)
    places = [_placed(values, one.rig) for values in (log, twin)]
    for k, values in enumerate((log, twin)):
        own = rows[:, k * COLUMNS : (k + 1) * COLUMNS]
        own[:, SLICES["time"]] = own[:, SLICES["episode_time"]] = (times - times[0])[:, None]
        own[:, SLICES["position"]], own[:, SLICES["joints"]] = places[k]
        own[:, SLICES["velocity"]] = np.gradient(places[k][0], interval, axis=0)
        own[:, SLICES["target"]] = own[:, SLICES["compliant"]] = places[0][0]
        own[:, SLICES["pressures"]] = _pressures(values, one.rig)
        at = np.clip(np.searchsorted(trial.times, times + 1e-9) - 1, 0, len(trial.times) - 1)
        own[:, SLICES["openings"]], own[:, SLICES["scenario_force"]] = trial.openings[:, at].T, trial.forces[:, at].T
        own[:, SLICES["drag_force"]] = 0.0
    head = {"format": FORMAT, "birthsim": __version__, "rig": one.rig.to_dict(), "columns": list(FIELDS), "interval": interval}
    settings = {"controller": "the log", "compare": f"{one.name} in free run"}
    with whole_file(path) as file:
        file.write(packed(head) + packed({"events": [{"row": 0, "settings": settings}]}, rows))


def _at(track: Track, times: Array, part: float) -> Array:
    """The values of a track of one window at ``times`` (T,), less a ``part`` of the error: 0 gives the log, and 1 the model."""
    known = np.isfinite(track.measured[0])
    values = track.measured[0, known] - part * track.error[0, known]
    return np.asarray(np.interp(times, track.times[0, known], values))


def _placed(values: dict[str, Array], rig: Parameters) -> tuple[Array, Array]:
    """The end effector and both pistons (T, 2), m."""
    if POSITIONS[0] in values:
        places = np.transpose([values[name] for name in POSITIONS])
        return places, pistons_of(places, rig)
    if PISTONS[0] in values:
        joints = np.array([values[name] for name in PISTONS])
    else:
        joints = np.array([np.zeros_like(values["position"]), values["position"]])
    return end_effector(joints, rig).T, joints.T


def _pressures(values: dict[str, Array], rig: Parameters) -> Array:
    """Absolute pressures of all chambers (T, 4), Pa; those of a locked cylinder are at atmospheric pressure."""
    topology, still = rig.linkage.topology, rig.air.atmospheric_pressure
    first = next(iter(values.values()))
    return np.transpose(
        [
            values[topology.name_of(f"pressures_{name}")] if k in topology.chambers else np.full_like(first, still)
            for k, name in enumerate(CHAMBERS)
        ]
    )
