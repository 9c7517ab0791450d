"""Dead-ended tubes behind a valve: the package's lumped tube beside the pressures measured at both ends.

Bore, valve and regulator of the measured tubes are not known, so that these are fitted: bore, own conductances for filling and
venting (that laboratory's regulator included), a lag, and a dead time for each pressure either way, which are the valve's. The
model is fitted on short tubes and then foretells long ones.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from baselines.work.tasks import Result
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.pneumatics import tubes, valves
from birthsim_env.physics.rig.parameters import Parameters

FOLDER = "tubes"
NEAR, FAR = range(2)
"""Ends of a tube: the valve's and the dead one."""

SUPPLIES, LENGTHS, FITTED = (3, 5, 7), tuple(range(1, 9)), (1, 2, 3)
"""bar gauge; m; m of the tubes that the model is fitted on."""

WAYS = {"start": True, "end": False}
"""Name of a file's part -> whether the tube is filled."""

LASTS, ROUNDED, FEWEST = 0.4, 1.5e-3, 5
"""s that are compared of a cycle; s within which rows of cycles count as one instant, the median of at least so many."""

STEP = 5e-5
"""s, of the explicit Euler method."""

AIR = Parameters().air
BAR = 1e5

NAMES = ("bore", "filling", "venting", "lag", *(f"{way}_{bar}" for way in WAYS for bar in SUPPLIES))
FIRST = (6.5e-3, 8e-9, 5e-8, 2e-3, 5e-3, 4e-3, 2e-3, 0.020, 0.021, 0.024)
BORE, FILLING, VENTING, LAG, DEAD = range(5)
UNITS = {"bore": "m", "filling": "m3/(s Pa)", "venting": "m3/(s Pa)", "lag": "s"}
CRITICAL = 0.3
"""b of the valve, which is not known; 0.01 instead errs less by 2 %."""

FARTHEST = 3.0
"""By e to this a parameter may be away from ``FIRST``."""


class Case(NamedTuple):
    """A tube (m) that is filled or not from or to the atmosphere: its supply and first pressure, Pa, and what was measured."""

    length: int
    supply: int
    fills: bool
    source: float
    first: float
    times: Array
    ends: Array


@kernel
def dead_ended(
    times: Array,
    length: float,
    bore: float,
    conductance: float,
    critical: float,
    slope: float,
    fills: bool,
    source: float,
    first: float,
    opens: float,
    lag: float,
    gas_t: float,
    atmosphere: float,
    rho0: float,
    step: float,
    ends: Array,
) -> None:
    """Writes the pressures at the valve's and at the dead end, Pa, (2, T), at rising ``times``, s.

    A valve opens at ``opens`` with a first-order ``lag``, to a ``source`` or to the atmosphere; ``slope`` is that of
    ``valves.laminar_slope``.
    """
    area, knee = 0.25 * np.pi * bore * bore, 1.0 / (1.0 - critical)
    sonic = tubes.conductance(length, bore)
    own = tubes.critical_ratio(sonic, bore)
    near, far = tubes.AT_VALVE * area * length, (1.0 - tubes.AT_VALVE) * area * length
    inertance, viscous = area / length, 32.0 * tubes.VISCOSITY * gas_t / (bore * bore)
    resistance = (1.0 - own) / (sonic * rho0 * (sonic * rho0))
    end, beyond, flow, time, beyond_valve = first, first, 0.0, 0.0, source if fills else atmosphere
    for k in range(len(times)):
        while time < times[k]:
            opened = 1.0 - np.exp((opens - time) / lag) if time > opens else 0.0
            entering = (
                conductance
                * opened
                * valves.driving_flow(beyond_valve, 1.0 / beyond_valve, 1.0, end, 1.0 / end, 1.0, rho0, critical, knee, slope)
            )
            rate = tubes.flow_rate(end, beyond, flow, 1.0, inertance, viscous, resistance, own)
            end, beyond = end + step * gas_t / near * (entering - flow), beyond + step * gas_t / far * flow
            flow, time = flow + step * rate, time + step
        ends[NEAR, k], ends[FAR, k] = end, beyond


def files_of(data: Path, length: int, supply: int, way: str) -> list[Path]:
    """The logs of a tube."""
    return sorted((data / FOLDER).glob(f"tube_l{length}_p{supply}_{way}*.csv"))


def _cycles(file: Path) -> Iterator[Array]:
    """Rows of each cycle, ms and bar gauge at both ends; a new one begins where the time does. Broken lines are left out."""
    lines = file.read_text(encoding="latin-1").splitlines()
    fields = [re.split(r"\s*,\s*", line.strip()) for line in lines]
    whole = [one for one in fields if len(one) == 5 and all(re.fullmatch(r"-?\d+(\.\d+)?", field) for field in one)]
    rows = np.array(whole, dtype=float)[:, :3]
    yield from np.split(rows, np.flatnonzero(np.diff(rows[:, 0]) < 0) + 1)


def case_of(data: Path, length: int, supply: int, way: str) -> Case:
    """Medians of the cycles that begin and end as they should."""
    fills, kept = WAYS[way], list[Array]()
    for file in files_of(data, length, supply, way):
        for one in _cycles(file):
            begins = one[0, 1:].max() < 0.2 if fills else one[0, 1] > 0.8 * supply
            if len(one) > 3 and one[-1, 0] < 3000 and begins and (one[-1, 1] > 0.75 * supply if fills else one[-1, 1] < 0.2):
                kept.append(one)
    level = float(np.median([one[-1, 1] if fills else one[0, 1] for one in kept]))
    rows = np.concatenate(kept)
    rows = rows[rows[:, 0] < 1e3 * LASTS]
    instant = np.round(rows[:, 0] / (1e3 * ROUNDED))
    several = [one for one in np.unique(instant) if (instant == one).sum() >= FEWEST]
    medians = np.array([np.median(rows[instant == one], axis=0) for one in several])
    source = level * BAR + AIR.atmospheric_pressure
    first = AIR.atmospheric_pressure if fills else source
    return Case(length, supply, fills, source, first, 1e-3 * medians[:, 0], medians[:, 1:].T)


def foretold(own: Array, case: Case) -> Array:
    """Pressures at both ends, bar gauge, (2, T), by parameters in the order of ``NAMES``."""
    ends = np.empty((2, len(case.times)))
    dead = own[DEAD + (0 if case.fills else len(SUPPLIES)) + SUPPLIES.index(case.supply)]
    dead_ended(
        case.times,
        float(case.length),
        float(own[BORE]),
        float(own[FILLING if case.fills else VENTING]),
        CRITICAL,
        valves.laminar_slope(CRITICAL),
        case.fills,
        case.source,
        case.first,
        float(dead),
        float(own[LAG]),
        AIR.gas_constant * AIR.temperature,
        AIR.atmospheric_pressure,
        AIR.reference_density,
        STEP,
        ends,
    )
    return (ends - AIR.atmospheric_pressure) / BAR


def rms(own: Array, cases: list[Case]) -> float:
    """bar; each tube, pressure, way and end counts alike."""
    return float(np.sqrt(np.mean([np.mean((foretold(own, one) - one.ends) ** 2) for one in cases])))


def measure(data: str, files: dict[str, str]) -> Result:
    """Parameters by least squares on ``FITTED``, and errors by length, bar."""
    cases = [case_of(Path(data), length, supply, way) for length in LENGTHS for supply in SUPPLIES for way in WAYS]
    short, first = [one for one in cases if one.length in FITTED], np.array(FIRST)

    def errors(x: Array) -> Array:
        own = first * np.exp(x)
        return np.concatenate([((foretold(own, one) - one.ends) / np.sqrt(one.ends.size)).ravel() for one in short])

    bounds = (-FARTHEST, FARTHEST)
    found: Any = least_squares(errors, np.zeros(len(first)), bounds=bounds, x_scale=0.1, diff_step=1e-3, max_nfev=60)
    own = first * np.exp(found.x)
    return {
        "parameters": dict(zip(NAMES, own.tolist(), strict=True)),
        "by_length": {str(length): rms(own, [one for one in cases if one.length == length]) for length in LENGTHS},
        "fitted": rms(own, short),
        "foretold": rms(own, [one for one in cases if one.length not in FITTED]),
        "all": rms(own, cases),
        "files": files,
    }
