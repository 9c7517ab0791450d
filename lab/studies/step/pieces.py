"""What is measured with one step of integration, each in a process that has it."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from baselines.work.tasks import Result
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.step import METHOD
from lab.studies.accuracy.errors import rigs_to_measure, run_method, runge_kutta
from lab.studies.accuracy.motions import MOTIONS
from lab.studies.comparison.grid import run_cell
from lab.studies.gradients.states import plant_of

LANES, RUNS = (1, 64, 256), 200
"""Lanes of which the kernel's time is taken, and runs of which the least counts."""


def courses(method: str, step: float, law: str, rigs: int, seed: int) -> Result:
    """Places and pressures of the accuracy study's rigs with a friction ``law`` in its motions, in steps of ``step``, s."""
    if method != METHOD:
        return _elsewhere(method, "courses", {"step": step, "law": law, "rigs": rigs, "seed": seed})
    own = list(rigs_to_measure(Parameters().replace({"friction.law": law}), rigs, seed).values())
    found = {name: run_method(own, motion, runge_kutta, step) for name, motion in MOTIONS.items()}
    return {
        name: {"position": one.position.tolist(), "pressure": one.pressure.tolist(), "clear": one.clear.tolist()}
        for name, one in found.items()
    }


def seconds(method: str, turn: int) -> Result:
    """CPU time of the plant's kernel a policy step of 10 ms and lane, s, by number of lanes; ``turn`` counts repetitions."""
    if method != METHOD:
        return _elsewhere(method, "seconds", {"turn": turn})
    found = {}
    for lanes in LANES:
        plant, command, force = plant_of(lanes, turn)
        state, best = plant.state.copy(), np.inf
        for _ in range(RUNS):
            plant.state[:] = state
            began = time.thread_time()
            plant.advance_unchecked(command, force[None], 0.01)
            best = min(best, time.thread_time() - began)
        found[str(lanes)] = best / lanes
    return found


def closed_loops(
    method: str, settings: dict[str, Any], environments: Sequence[str], sensors: Sequence[str], episodes: int, seed: int
) -> Result:
    """Metrics of a controller with these ``grid.settings_of``, per environment and sensor model, on rigs drawn at random."""
    if method != METHOD:
        rest = {"settings": settings, "environments": environments, "sensors": sensors, "episodes": episodes, "seed": seed}
        return _elsewhere(method, "closed_loops", rest)
    found = {}
    for environment in environments:
        for model in sensors:
            cell = run_cell(
                **settings, environment=environment, sensors=model, plant="randomised", hand="", episodes=episodes, seed=seed
            )
            metrics = {name: [None if not np.isfinite(v) else v for v in row] for name, row in cell["metrics"].items()}
            found[f"{environment} {model}"] = {"metrics": metrics, "lost": list(map(bool, cell["lost"]))}
    return found


def _elsewhere(method: str, function: str, settings: dict[str, Any]) -> Result:
    """What a function of this module gives in a process that has another step."""
    code = f"import json, sys\nfrom {__name__} import {function}\njson.dump({function}(**json.load(sys.stdin)), sys.stdout)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        input=json.dumps({"method": method, **settings}),
        text=True,
        stdout=subprocess.PIPE,
        check=True,
        env={**os.environ, "BIRTHSIM_STEP": method, "PYTHONPATH": str(ROOT)},
    )
    found: Result = json.loads(done.stdout)
    return found
