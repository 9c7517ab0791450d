"""Logs of a rig with rows that no rig makes: each is refused in one line, or read so that it can be fitted."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from baselines.identification.trial import Trial
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import NUMBERS, Rng

SIGNALS = ("times", "openings", "pressures", "positions", "forces")
DURATION = 4.0
"""s of the log, of which a part is taken."""

ROWS = 2400
"""Of a log."""

FITTED = 0.1
"""Fraction of the logs that are read in which a fit is tried."""

FLOATS = [value for value in NUMBERS if isinstance(value, float)] + [65535.0, -32768.0, 4294967295.0]
FACTORS = (1e-6, 1e-5, 1e-3, 1e-2, 0.5, 0.9, 1.1, 2.0, 5.0, 10.0, 100.0, 1e3, 32767.0, -1.0, 0.0)


def _log(_: Path) -> Trial:
    """A log, and what reading and fitting one needs, before memory is limited."""
    from baselines.identification.experiment import propose
    from baselines.identification.laboratory import run_plan
    from baselines.registry import make_controller
    from birthsim_env.physics.rig.parameters import Parameters

    rig = Parameters()
    whole = run_plan(propose(rig, DURATION, 1), [rig], make_controller("backstepping", rig), "lab", 1)[0]
    log = Trial(*(getattr(whole, name)[..., :ROWS].copy() for name in SIGNALS))
    _fitted(log)
    return log


def _fitted(log: Trial) -> None:
    from baselines.identification.estimate import Problem, search
    from baselines.identification.free_parameters import FREE_PARAMETERS
    from baselines.identification.noise import guessed_noise
    from baselines.identification.windows import cut
    from birthsim_env.physics.rig.parameters import Parameters

    rig, some = (
        Parameters(),
        tuple(one for one in FREE_PARAMETERS if one.name in ("mechanics.mass", "valves.sonic_conductance")),
    )
    windows = cut(log, rig, 0.05)
    chosen = np.unique(np.linspace(0, len(windows.starts) - 1, 3).astype(np.intp))
    problem = Problem(windows.some(chosen), guessed_noise(log), rig, some, lambda: None)
    fit = search(problem, problem.centre, 4)
    assert np.isfinite(fit.theta).all()
    assert np.isfinite([fit.noise.pressure, fit.noise.position]).all()


def _rows(rng: Rng, count: int) -> NDArray[np.intp]:
    """Rows that something happens to: a few, a stretch, many, or all."""
    first, length = int(rng.integers(count)), int(rng.choice([1, 3, 30, 300, count]))
    scattered = np.flatnonzero(rng.random(count) < rng.choice([1e-3, 0.01, 0.3]))
    return scattered if rng.random() < 0.5 else np.arange(first, min(count, first + length))


def _altered(rng: Rng, log: dict[str, Array]) -> None:
    """One thing that sensors, cables, loggers or hands do to a log."""
    name = SIGNALS[rng.integers(len(SIGNALS))]
    signal = np.atleast_2d(log[name])
    axes = rng.permutation(len(signal))[: int(rng.integers(1, len(signal) + 1))]
    rows = _rows(rng, signal.shape[1])
    part = np.ix_(axes, rows)

    def everywhere(change: Callable[[Array], Array]) -> None:
        log.update({one: change(log[one]) for one in SIGNALS})

    match int(rng.integers(10)):
        case 0 | 1:
            signal[part] = FLOATS[rng.integers(len(FLOATS))]
        case 2:
            signal[part] *= FACTORS[rng.integers(len(FACTORS))]
        case 3:
            signal[part] += rng.choice(FLOATS) if rng.random() < 0.3 else np.std(signal) * rng.normal()
        case 4:
            signal[part] += np.std(signal) * rng.normal(size=(len(axes), len(rows)))
        case 5 if len(rows):
            signal[part] = signal[axes][:, rows[:1]]
        case 6:
            signal[np.sort(axes)] = signal[axes]
        case 7:
            everywhere(lambda values: np.delete(values, rows, axis=-1))
        case 8:
            everywhere(lambda values: np.insert(values, rows, values[..., rows], axis=-1))
        case 9:
            low, high = np.nanquantile(signal[axes], [0.1, 0.9])
            signal[axes] = np.clip(signal[axes], low, high)


def _read(good: Trial, rng: Rng, _: Path, case: Case) -> None:
    from baselines.identification.rows import checked_trial
    from birthsim_env.physics.rig.parameters import Parameters

    log = {name: getattr(good, name).copy() for name in SIGNALS}
    with np.errstate(all="ignore"):
        for _change in range(int(rng.integers(1, 4))):
            _altered(rng, log)
    case.names, case.shown = ("log",), ", ".join(f"{name} {values.shape}" for name, values in log.items())
    found = checked_trial("log", replace(good, **log), Parameters())
    assert np.isfinite(found.openings).all()
    assert np.abs(found.openings).max() <= 1.0
    assert np.isfinite(found.forces).all()
    assert (np.diff(found.times) > 0).all()
    known = found.pressures[np.isfinite(found.pressures)]
    assert 0.0 < known.min() < known.max() < 1e6
    assert np.nanmax(np.hypot(*found.positions)) < 1.0
    if rng.random() < FITTED:
        _fitted(found)


LOGS: dict[str, Kind] = {"rows": Kind(_log, _read)}
