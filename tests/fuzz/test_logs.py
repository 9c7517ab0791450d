"""Logs of a rig with rows that no rig makes: each is refused in one line, or read so that it can be fitted."""

from dataclasses import replace
from functools import cache

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from baselines.identification.experiment import propose
from baselines.identification.fit.estimate import search
from baselines.identification.fit.free_parameters import FREE_PARAMETERS
from baselines.identification.fit.problem import Problem
from baselines.identification.laboratory import run_plan
from baselines.identification.log.rows import checked_trial
from baselines.identification.log.trial import Trial
from baselines.identification.windows.noise import guessed_noise
from baselines.identification.windows.windows import cut
from baselines.named import make_controller
from birthsim_env import Parameters
from tests.fuzz.strategies import NUMBERS, composite, sampled
from tests.fuzz.watched import cases, watched

SIGNALS = ("times", "openings", "pressures", "positions", "forces")
RIG = Parameters()
ROWS = 2400
FLOATS = (*(value for value in NUMBERS if isinstance(value, float)), 65535.0, -32768.0, 4294967295.0)
FACTORS = (1e-6, 1e-5, 1e-3, 1e-2, 0.5, 0.9, 1.1, 2.0, 5.0, 10.0, 100.0, 1e3, 32767.0, -1.0, 0.0)


@cache
def log():
    """4 s of a rig, of which the first rows are taken; as it is, it is fitted."""
    whole = run_plan(propose(RIG, 4.0, 1), [RIG], make_controller("backstepping", RIG), "lab", 1)[0]
    found = Trial(*(getattr(whole, name)[..., :ROWS].copy() for name in SIGNALS))
    fit(found)
    return found


def fit(trial):
    some = tuple(one for one in FREE_PARAMETERS if one.name in ("mechanics.mass", "valves.sonic_conductance"))
    windows = cut(trial, RIG, 0.05)
    chosen = np.unique(np.linspace(0, len(windows.starts) - 1, 3).astype(np.intp))
    problem = Problem(windows.some(chosen), guessed_noise(trial), RIG, some, lambda: None)
    found = search(problem, problem.centre, 4)
    assert np.isfinite(found.theta).all()
    assert np.isfinite([found.noise.pressure, found.noise.position]).all()


@composite
def rows(draw, count):
    """Rows that something happens to: a stretch, scattered ones, or all."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    scattered = np.flatnonzero(rng.random(count) < draw(sampled((1e-3, 0.01, 0.3))))
    first, length = draw(st.integers(0, count - 1)), draw(sampled((1, 3, 30, 300, count)))
    return draw(sampled((scattered, np.arange(first, min(count, first + length)))))


@composite
def faulty(draw):
    """A log to which sensors, cables, loggers or hands have done one to three things."""
    signals = {name: getattr(log(), name).copy() for name in SIGNALS}
    for _ in range(draw(st.integers(1, 3))):
        name = draw(sampled(SIGNALS))
        signal = np.atleast_2d(signals[name])
        axes = draw(st.permutations(range(len(signal))))[: draw(st.integers(1, len(signal)))]
        at = draw(rows(signal.shape[1]))
        part, spread = np.ix_(axes, at), np.nanstd(signal)
        match draw(
            sampled(("value", "value", "factor", "offset", "shift", "noise", "held", "swapped", "lost", "twice", "clipped"))
        ):
            case "value":
                signal[part] = draw(sampled(FLOATS))
            case "factor":
                signal[part] *= draw(sampled(FACTORS))
            case "offset":
                signal[part] += draw(sampled(FLOATS))
            case "shift":
                signal[part] += spread * draw(st.floats(-3, 3))
            case "noise":
                signal[part] += spread * np.random.default_rng(len(at)).normal(size=(len(axes), len(at)))
            case "held" if len(at):
                signal[part] = signal[axes][:, at[:1]]
            case "swapped":
                signal[np.sort(axes)] = signal[axes]
            case "lost":
                signals = {one: np.delete(values, at, axis=-1) for one, values in signals.items()}
            case "twice":
                signals = {one: np.insert(values, at, values[..., at], axis=-1) for one, values in signals.items()}
            case "clipped":
                signal[axes] = np.clip(signal[axes], *np.nanquantile(signal[axes], [0.1, 0.9]))
    return signals


@cases
@given(data=st.data(), fitted=sampled((*[False] * 9, True)))
def test_rows(data, fitted):
    signals = data.draw(faulty())
    with watched("log"):
        found = checked_trial("log", replace(log(), **signals), RIG)
        assert np.isfinite(found.openings).all()
        assert np.abs(found.openings).max() <= 1.0
        assert np.isfinite(found.forces).all()
        assert (np.diff(found.times) > 0).all()
        known = found.pressures[np.isfinite(found.pressures)]
        assert 0.0 < known.min() < known.max() < 1e6
        assert np.nanmax(np.hypot(*found.positions)) < 1.0
        if fitted:
            fit(found)
