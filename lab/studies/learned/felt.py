"""What a hand feels of policies and controllers: a policy that tracks may render no stiffness, or give energy to the hand."""

from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.named import make_controller
from baselines.work.tasks import Result
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.haptics.worlds import Condition
from lab.studies.shaken import shaken

LANES, SEED = 32, 74_600_000
"""Randomised rigs, and the seed of the first. Those from 74300000 on guided the training of ``probe_apg``."""

COLUMNS = {"stiffness_error": "static stiffness error, %", "noticed": "JND at 1 Hz", "energy": "energy given, mJ"}
"""Figure -> its column: sizes in ``Probe-v3``; of ``lab.studies.shaken``."""


def measure(controller: str, source: str, rig: dict[str, Any], sensors: str, **options: Any) -> Result:
    """``COLUMNS`` of every rig, infinite where it is lost; ``rig`` is as believed, ``options`` are the controller's."""
    believed = Parameters.from_dict(rig)
    world: dict[str, Any] = {"sensors": sensors, "randomize": True, "parameters": believed}
    probe = evaluate(
        "BirthSIM/Probe-v3", make_controller(controller, believed, **options), controller, LANES, SEED, progress=False, **world
    )
    rigs = Condition(controller, believed, sensors, SEED, LANES, True).drawn()
    found = shaken(make_controller(controller, believed, **options), rigs, sensors, SEED)
    lost, energy = found["lost"] > 0, 1e3 * found["energy"]
    static = np.abs(penalize_lost(probe.metrics["stiffness_error"], probe.lost))
    felt = {"noticed": penalize_lost(found["noticed"], lost), "energy": penalize_lost(energy, lost), "stiffness_error": static}
    return {name: jsonable(felt[name].tolist()) for name in COLUMNS}


def metrics_of(results: list[Result]) -> dict[str, list[float]]:
    """Median, 95th percentile and worst of each of ``COLUMNS`` over rigs, and over training seeds where there are several."""
    every = {name: [float("inf") if value == "lost" else value for one in results for value in one[name]] for name in COLUMNS}
    return {name: [quantile(values, part) for part in (0.5, 0.95, 1.0)] for name, values in every.items()}
