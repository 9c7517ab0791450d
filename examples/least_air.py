"""How much air the schedule of least air saves, and what it does to the errors.

    python examples/least_air.py --episodes 64 --seed 96000

Circle and Descent with their own pneumatic stiffness and with ``least_air``; rigs drawn at random, the same for both.
"""

import argparse

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.registry import make_controller
from birthsim_env.parts.scenarios import SCENARIOS, environment_id
from birthsim_env.physics.rig.parameters import Parameters
from studies.least_air.schedule import least_air

PUSHES = {"circle": [(30.0, 0.0), (-30.0, 0.0), (0.0, 30.0), (0.0, -30.0)], "descent": [(80.0, 0.0)]}
"""N: the strongest pushes of the scenarios' hands."""

LAWS = ("backstepping", "admittance-backstepping")

HEAD = "| scenario | law | sensors | air, l/min | with least air | saved, % | settled error, mm | with least air | lost |"


def measured(scenario, law, sensors, episodes, seed):
    """A row of the table: medians, and 95 % of the errors."""
    rig = Parameters()
    reference, _, own = SCENARIOS[scenario].nominal()
    least = least_air(reference, own, SCENARIOS[scenario].duration, rig, PUSHES[scenario])
    found = [
        evaluate(
            environment_id(scenario), make_controller(law, rig), law, episodes, seed, False, sensors=sensors, randomize="plant",
            stiffness=stiffness,
        )
        for stiffness in (own, least)
    ]  # fmt: skip
    air = [np.array(one.metrics["air"]) for one in found]
    saved = 100 * (1 - air[1] / air[0])
    errors = [", ".join(f"{q:.3g}" for q in np.quantile(one.metrics["settled_rms"], (0.5, 0.95))) for one in found]
    spread = f"{np.median(saved):.1f} ({np.quantile(saved, 0.05):.1f} to {np.quantile(saved, 0.95):.1f})"
    cells = (*(f"{np.median(one):.3g}" for one in air), spread, *errors, f"{sum(found[0].lost)}, {sum(found[1].lost)}")
    return f"| {scenario} | `{law}` | {sensors} | {' | '.join(cells)} |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=64)
    parser.add_argument("--seed", type=int, default=96000)
    parser.add_argument("--scenarios", nargs="+", choices=list(PUSHES), default=list(PUSHES))
    arguments = parser.parse_args()
    print(HEAD)
    print("|" + "---|" * HEAD.count(" | ") + "---|")
    for scenario in arguments.scenarios:
        for law in LAWS:
            for sensors in ("ideal", "lab"):
                print(measured(scenario, law, sensors, arguments.episodes, arguments.seed), flush=True)
