"""Where the backstepping laws begin to swing, over rigs and latencies: what ``baselines.backstepping.stiffest`` is made of.

    python -m baselines.commands.stiffest

Per law and rig: the last of a row of setpoints from 1 to 64 kN/m, each 1.2 times the one before, up to which a push of 40 N
leaves the nominal rig within 20 mm, over m/(tau + latency/4).
"""

from __future__ import annotations

import itertools

import numpy as np
from tqdm import tqdm

from baselines.backstepping import stiffest
from baselines.bench.stability import Cases, judge
from baselines.registry import make_controller
from birthsim_env.physics.rig.parameters import Parameters

MASSES, LAGS, LATENCIES = (1.5, 3.0, 6.0), (0.002, 0.004, 0.008), (0.0, 0.004, 0.012)
"""kg, s and s; without latency positions are exact."""

ASKED = np.array([1000.0 * 1.2**step for step in range(24)])

SWING = 0.02
"""m, peak to peak."""


def main() -> None:
    """Measure and print."""
    print(
        f"{'law':24}{'mass, kg':>10}{'valve, ms':>10}{'late, ms':>10}{'rests up to, N/m':>18}{'over m/(tau + late/4), 1/s':>28}"
    )
    cases = list(itertools.product(("backstepping", "backstepping-cartesian"), MASSES, LAGS, LATENCIES))
    for name, mass, lag, late in tqdm(cases, leave=False):
        rig = Parameters().replace({"mechanics.mass": mass, "valves.time_constant": lag, "electronics.position_latency": late})
        limit = rests_up_to(name, rig, "lab" if late else "ideal")
        rate = limit * (lag + stiffest.PART * late) / mass
        tqdm.write(f"{name:24}{mass:10g}{1e3 * lag:11g}{1e3 * late:10g}{limit:18.0f}{rate:28.1f}")


def rests_up_to(name: str, rig: Parameters, sensors: str) -> float:
    """N/m: the last of ``ASKED`` before the first at which the law swings, without its own bound; infinite where none does."""
    own, stiffest.RATE = stiffest.RATE, np.inf
    try:
        still = np.zeros(len(ASKED))
        verdict = judge(Cases([rig] * len(ASKED), still, ASKED, still, still), make_controller(name, rig), sensors, 0, None)
    finally:
        stiffest.RATE = own
    swings = verdict.lost | (verdict.motion > SWING)
    return float(ASKED[max(int(np.argmax(swings)) - 1, 0)]) if swings.any() else np.inf


if __name__ == "__main__":
    main()
