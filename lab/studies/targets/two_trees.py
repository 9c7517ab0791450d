"""Compares two trees of the sources on a GPU in a few minutes, bits first.

git archive --prefix=out/before/ COMMIT | tar x
python -m lab.studies.targets.two_trees out/before [device] [lanes]

The tree in the folder and this one take turns, each in processes of its own, on the Circle with ideal sensors and drawn rigs.
Printed are a hash of what 64 of the lanes see and earn in 40 steps, which has to be that of the processor, and a million policy
steps of 10 ms a second: of the environment, and of the kernel alone, without what arrays of CuPy's do around it.
"""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import birthsim_env as birthsim_env  # registers ids
from birthsim_build.device.beginning import beginning_with
from birthsim_build.device.lanes import Lanes
from birthsim_build.device.loops import SEVERAL
from birthsim_build.device.machine import machine_named
from birthsim_env.assembly import assemble
from birthsim_env.episodes import Episodes
from birthsim_env.loop.world import Start
from lab.studies.targets.gpu import Clock, stepping

FEW, STEPS, TURNS = 64, 40, 3
CIRCLE = "BirthSIM/Circle-v2"


def bits(device: str, lanes: int) -> str:
    """A hash of what the first ``FEW`` lanes see and earn."""
    env = gymnasium.make_vec(CIRCLE, num_envs=lanes, randomize=True, device=device)
    xp = np if device == "cpu" else machine_named(device).arrays
    rng, found = np.random.default_rng(0), hashlib.sha256()
    env.reset(seed=0)
    for _ in range(STEPS):
        actions = xp.zeros(env.action_space.shape, dtype=np.float32)
        actions[:FEW] = xp.asarray(rng.uniform(-0.3, 0.3, (FEW, 4)).astype(np.float32))
        for one in env.step(actions)[:2]:
            few = one[:FEW]
            found.update((few if xp is np else xp.asnumpy(few)).tobytes())
    return found.hexdigest()[:16]


def kernel(clock: Clock, device: str, count: int) -> float:
    """Policy steps/s of ``count`` lanes, without an environment."""
    episodes = [Episodes(assemble(few, "circle", randomize=True)) for few in SEVERAL]
    machine, xp = machine_named(device), clock.arrays
    many, other = map(beginning_with, episodes)
    lanes, start = Lanes(machine, many, other, count), xp.zeros((Start.size, count))
    start.view(np.int64)[Start.seed.first] = xp.arange(count)
    lanes.begin(xp.arange(count), start)
    periods = episodes[0].simulation.periods
    return count / clock.seconds(lambda: lanes.advance(periods))


def measured(device: str, lanes: int) -> dict[str, Any]:
    """What this process finds."""
    clock = Clock(device, 1.0)
    found = {"environment": stepping(clock, device, lanes, CIRCLE), "kernel": kernel(clock, device, lanes)}
    return {**found, "bits": bits(device, lanes)}


def compare(before: Path, device: str, lanes: int) -> bool:
    """Print what both trees give; whether all have the bits of the processor."""
    expected, same = bits("cpu", FEW), True
    print("processor", expected, flush=True)
    for turn in range(TURNS):
        for name, tree in (("before", before), ("after", Path.cwd())):
            environment = {**os.environ, "PYTHONPATH": f"{tree.resolve()}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
            line = [sys.executable, __file__, "--measure", device, str(lanes)]
            done = subprocess.run(line, env=environment, cwd=tree, check=True, stdout=subprocess.PIPE, text=True)
            found = json.loads(done.stdout.splitlines()[-1])
            same &= found["bits"] == expected
            speeds = (f"{what} {found[what] / 1e6:.3g}" for what in ("environment", "kernel"))
            print(turn, name, found["bits"], *speeds, flush=True)
    return same


if __name__ == "__main__":
    if sys.argv[1] == "--measure":
        print(json.dumps(measured(sys.argv[2], int(sys.argv[3]))))
    else:
        given = dict(enumerate(sys.argv))
        sys.exit(not compare(Path(given[1]), given.get(2, "cuda"), int(given.get(3, 1 << 20))))
