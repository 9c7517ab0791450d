"""Times the threads of a device.

python -m lab.studies.targets.gpu [cuda or host] [most lanes] [seconds a figure]

Loops advance policy steps of 10 ms with all that an environment does, episodes that end and begin included. Arrays stay on the
device, or come from NumPy and go back to it ("copied"); the same loop runs natively on one core of this processor. ``cuda``
needs pip install -e '.[cuda]'.
"""

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np

import agents as agents  # registers ids with a controller inside
from birthsim_build.device.machine import machine_named
from lab.engine.tables import markdown

LOOPS: dict[str, tuple[str, dict[str, Any]]] = {
    "Circle, ideal": ("BirthSIM/Circle-v2", {}),
    "Circle, honest": ("BirthSIM/Circle-v2", {"sensors": "honest"}),
    "Circle residual, lab": ("BirthSIM/CircleResidual-v2", {"sensors": "lab"}),
    "Descent, ideal": ("BirthSIM/Descent-v2", {}),
}
NATIVE_LANES = 256
MOST_TAPES = 1 << 18
"""Lanes whose tapes a GPU certainly has room for."""

SUMS = """
extern "C" __global__ void sums(double* out, double by) {
  double a = threadIdx.x, b = a + 1, c = a + 2, d = a + 3;
  for (int k = 0; k < 4096; ++k) {
    a = __dadd_rn(__dmul_rn(a, by), by); b = __dadd_rn(__dmul_rn(b, by), by);
    c = __dadd_rn(__dmul_rn(c, by), by); d = __dadd_rn(__dmul_rn(d, by), by);
  }
  out[blockIdx.x * blockDim.x + threadIdx.x] = a + b + c + d;
}"""


class Clock:
    """Seconds of work on a device."""

    def __init__(self, device: str, budget: float) -> None:
        self.arrays, self.budget = machine_named(device).arrays, budget

    def wait(self) -> None:
        """Until all that was asked for is done."""
        if self.arrays is not np:
            self.arrays.cuda.Device().synchronize()

    def seconds(self, work: Callable[[], Any]) -> float:
        """Median over calls for ``budget`` seconds, at least three, after one that may compile."""
        spent, until = [], None
        while until is None or time.perf_counter() < until or len(spent) < 4:
            self.wait()
            began = time.perf_counter()
            work()
            self.wait()
            spent.append(time.perf_counter() - began)
            until = until or time.perf_counter() + self.budget
        return float(np.median(spent[1:]))


def limits(clock: Clock) -> dict[str, float]:
    """What a GPU can do: sums and products in double precision/s without fusing, bytes copied/s on it, and to it."""
    xp, there = clock.arrays, clock.arrays.zeros(1 << 28)
    kernel, here = xp.RawKernel(SUMS, "sums"), np.zeros(1 << 24)
    run = clock.seconds(lambda: kernel((4096,), (256,), (there, np.float64(0.5))))
    copied, sent = clock.seconds(there.copy), clock.seconds(lambda: xp.asarray(here))
    found = {"operations/s": 4096 * 256 * 4096 * 8 / run, "bytes/s there": 2 * there.nbytes / copied}
    return {**found, "bytes/s to it": here.nbytes / sent}


def stepping(clock: Clock, device: str, lanes: int, name: str, copied: bool = False, **arguments: Any) -> float:
    """Policy steps/s of all lanes."""
    env = gymnasium.make_vec(name, num_envs=lanes, randomize=True, device=device, **arguments)
    xp = np if device == "cpu" else clock.arrays
    rng = np.random.default_rng(0)
    drawn = [rng.uniform(-0.3, 0.3, env.action_space.shape).astype(np.float32) for _ in range(4)]
    actions = drawn if copied else [xp.asarray(one) for one in drawn]
    env.reset(seed=0, options={"staggered": True})
    count = 0

    def step() -> None:
        nonlocal count
        found, count = env.step(actions[count % 4])[:4], count + 1
        if copied and xp is not np:
            [xp.asnumpy(one) for one in found]

    return lanes / clock.seconds(step)


def beginning(clock: Clock, device: str, lanes: int, name: str, **arguments: Any) -> float:
    """Episodes/s that begin, with what is drawn."""
    env = gymnasium.make_vec(name, num_envs=lanes, randomize=True, device=device, **arguments)
    env.reset(seed=0)
    return lanes / clock.seconds(env.reset)


def going_back(clock: Clock, device: str, lanes: int, name: str, **arguments: Any) -> float:
    """Policy steps/s forward on a tape, and back."""
    env: Any = gymnasium.make_vec(name, num_envs=lanes, randomize=True, device=device, autoreset_mode="SameStep", **arguments)
    recorder, xp = env.unwrapped.record(), np if device == "cpu" else clock.arrays
    env.reset(seed=0, options={"staggered": True})
    ones, action = xp.ones(lanes), xp.zeros(env.action_space.shape, dtype=np.float32)

    def step() -> None:
        env.step(action)
        recorder.taken()(reward=ones)

    return lanes / clock.seconds(step)


def rows(clock: Clock, device: str, most: int) -> list[tuple[str, ...]]:
    """A row a loop and number of lanes, below the head."""
    found: list[tuple[str, ...]] = [("loop", "lanes", "steps/s", "copied", "beginnings/s", "steps/s with gradients")]
    for label, (name, arguments) in LOOPS.items():
        for lanes in (None, *(1 << k for k in range(10, 21, 2) if 1 << k <= most)):
            place, count = (device, lanes) if lanes else ("cpu", NATIVE_LANES)
            runs: list[Callable[..., float]] = [stepping, partial(stepping, copied=True), beginning, going_back]
            rates = [run(clock, place, count, name, **arguments) for run in (runs if count <= MOST_TAPES else runs[:3])]
            cells = [f"{one:,.0f}" for one in rates]
            found.append((label, f"{count:,}" + (", native" if place is None else ""), *cells, *[""] * (4 - len(cells))))
            print(*found[-1], sep=" | ", flush=True)
    return found


if __name__ == "__main__":
    given = dict(enumerate(sys.argv))
    chosen, most, budget = given.get(1, "cuda"), int(given.get(2, 1 << 20)), float(given.get(3, 1.0))
    watch = Clock(chosen, budget)
    if chosen == "cuda":
        named = watch.arrays.cuda.runtime.getDeviceProperties(0)["name"].decode()
        print(named, {what: f"{rate:.3g}" for what, rate in limits(watch).items()})
    print(markdown(rows(watch, chosen, most)))
