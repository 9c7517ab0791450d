"""Where the backstepping laws begin to swing, over rigs and latencies: what ``baselines.backstepping.stiffest`` is made of.

    birthsim study stiffest

Per law and rig: the last of a row of setpoints from 1 to 64 kN/m, each 1.2 times the one before, up to which a push of 40 N
leaves the nominal rig within 20 mm, over m/(tau + latency/4).
"""

from __future__ import annotations

import argparse
import itertools
from typing import cast

import numpy as np
from tqdm import tqdm

from baselines.backstepping.stiffest import PART
from baselines.commands.shared import run
from baselines.registry import make_controller
from baselines.staged import StagedController
from birthsim_env.physics.rig.parameters import Parameters
from studies.results import Rows, measure
from studies.stability.maps import Cases, judge

MASSES, LAGS, LATENCIES = (1.5, 3.0, 6.0), (0.002, 0.004, 0.008), (0.0, 0.004, 0.012)
"""kg, s and s; without latency positions are exact."""

ASKED = np.array([1000.0 * 1.2**step for step in range(24)])

SWING = 0.02
"""m, peak to peak."""


UNITS = {"controller": "", "mass": "kg", "valve": "s", "latency": "s", "limit": "N/m", "rate": "1/s"}


def main() -> None:
    """Entry point."""
    run(argparse.ArgumentParser(prog="birthsim study stiffest", description=(__doc__ or "").splitlines()[0]), _measure)


def _measure(_: argparse.Namespace) -> None:
    print(f"written to {measure('stiffest', 'studies.stability.stiffest', UNITS, (0,), _rows)}")


def _rows() -> Rows:
    """A row per controller, mass, lag and latency; no limit (None) where it swings at no setpoint."""
    cases = list(itertools.product(("backstepping", "backstepping-cartesian"), MASSES, LAGS, LATENCIES))
    return [_row(*case) for case in tqdm(cases, "stiffest", leave=False)]


def _row(name: str, mass: float, lag: float, late: float) -> dict[str, str | float | None]:
    rig = Parameters().replace({"mechanics.mass": mass, "valves.time_constant": lag, "electronics.position_latency": late})
    limit = rests_up_to(name, rig, "lab" if late else "ideal")
    rate = limit * (lag + PART * late) / mass
    row = (name, mass, lag, late, *((limit, rate) if np.isfinite(limit) else (None, None)))
    return dict(zip(UNITS, row, strict=True))


def rests_up_to(name: str, rig: Parameters, sensors: str) -> float:
    """N/m: the last of ``ASKED`` before the first at which the law swings, without its own bound; infinite where none does."""
    law, still = cast(StagedController, make_controller(name, rig)), np.zeros(len(ASKED))
    stages = law.law_stages
    law.law_stages = lambda sampled: stages(sampled)[1:]  # type: ignore[method-assign]
    verdict = judge(Cases([rig] * len(ASKED), still, ASKED, still, still), law, sensors, 0, None)
    swings = verdict.lost | (verdict.motion > SWING)
    return float(ASKED[max(int(np.argmax(swings)) - 1, 0)]) if swings.any() else np.inf
