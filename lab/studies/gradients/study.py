"""What gradients cost beside the plain step, in turns, and how large a change they foretell."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from agents.residual.env import ResidualVectorEnv
from baselines.bench.statistics import quantile
from baselines.work.tasks import Result, Task
from birthsim_env import Plant
from birthsim_env.gradients.plant import Derivatives, jvp, vjp
from birthsim_env.gradients.recorder import Recorder
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import Cell, Head, digits, markdown
from lab.studies.gradients.figure import friction_figure
from lab.studies.gradients.states import plant_of

STEP, TURNS = 0.01, 25
"""s of a policy step; turns of which the median is taken."""

LANES, CHANGES, INSTANTS = 512, (1e-4, 1e-2, 0.1), (0.01, 0.04, 0.16, 0.32)
"""Rigs; changes of the openings; s after which pistons are looked at."""

OPENINGS, AFTER = np.arange(-30, 31) / 100.0, 0.1
"""Of the valve that fills the front of cylinder 2, and of the other its negative; s from rest."""

PLANTS = {"plant, 256 lanes": (256, False), "plant, 256 lanes, with the rig": (256, True), "plant, 4096 lanes": (4096, False)}
LOOPS = {"no controller, 256 lanes": "none", "admittance-backstepping, 256 lanes": "admittance-backstepping"}


def seconds(calls: dict[str, Callable[[], Any]]) -> Result:
    """Median CPU s of each of ``calls``, in turns, after a first turn that may compile."""
    spent: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(TURNS + 1):
        for name, call in calls.items():
            began = time.process_time()
            call()
            if turn:
                spent[name].append(time.process_time() - began)
    return {name: float(np.median(found)) for name, found in spent.items()}


def plant_cost(lanes: int, rig: bool) -> Result:
    """Of a policy step of the plant alone; with ``rig`` the gradients to its parameters too."""
    (plain, opening, force), (taped, _, _) = plant_of(lanes, 0), plant_of(lanes, 0)
    start, weight, kept = plain.state.copy(), np.ones_like(plain.state), dict[str, Any]()

    def advance() -> None:
        plain.state[:] = start
        plain.advance_unchecked(opening, force[None], STEP)

    def tape() -> None:
        taped.state[:] = start
        kept["back"] = vjp(taped, opening, force[None], STEP)

    return seconds({"forward": advance, "taped": tape, "backward": lambda: kept["back"](weight, rig)})


def loop_cost(law: str) -> Result:
    """Of a policy step of a residual environment on ``law``, 256 lanes, one thread."""
    made: dict[str, Any] = {"num_envs": 256, "law": law, "randomize": True, "num_threads": 1}
    plain, taped = list[Any](gymnasium.make_vec("BirthSIM/CircleResidual-v2", **made).unwrapped for _ in range(2))
    recorder, action, kept = Recorder(taped.simulation), np.zeros(taped.action_space.shape), dict[str, Any]()
    for env in (plain, taped):
        env.reset(seed=0)

    def tape() -> None:
        taped.step(action)
        kept["back"] = recorder.taken()

    return seconds(
        {
            "forward": lambda: plain.step(action),
            "taped": tape,
            "backward": lambda: kept["back"](reward=np.ones(256)),
        }
    )


def foretold(slides: bool) -> Result:
    """Relative errors of the displacement that gradients foretell when all openings change: median and 90 % of the rigs."""
    plant, opening, force = plant_of(LANES, 11)
    rng = np.random.default_rng(2)
    if slides:
        plant.state[[at.V1, at.V2]] = np.sign(rng.standard_normal((2, LANES))) * rng.uniform(0.05, 0.15, (2, LANES))
        opening *= 0.3
    else:
        place = rng.uniform([[-0.08], [-0.15]], [[0.08], [0.15]], (2, LANES))
        plant.state[:] = balanced_state(plant.lane_parameters, place)
        opening, force = 0.05 * rng.standard_normal((4, LANES)), 3 * rng.standard_normal((2, LANES))
    start, way = plant.state.copy(), rng.standard_normal((4, LANES))
    way /= np.abs(way).max(axis=0)
    along, pistons, errors = Derivatives(np.zeros_like(start), way, np.zeros((1, 2, LANES))), [at.Y1, at.Y2], []
    for duration in INSTANTS:
        plant.state[:] = start
        tangent, unchanged = jvp(plant, opening, force[None], duration, along)[pistons], plant.state[pistons]
        for change in CHANGES:
            plant.state[:] = start
            plant.advance_unchecked(np.clip(opening + change * way, -1, 1), force[None], duration)
            moved = (plant.state[pistons] - unchanged) / change
            size = np.hypot(*moved)
            apart = size > 1e-7  # a piston at its stop does not move
            off = (np.hypot(*(moved - tangent)) / np.maximum(size, 1e-9))[apart]
            errors.append({"after": duration, "change": change, "median": quantile(off, 0.5), "q90": quantile(off, 0.9)})
    return {"errors": errors}


def pushed() -> Result:
    """How far piston 2 of the nominal rig has moved ``AFTER`` it was at rest, by ``OPENINGS``, m, and the slopes of that."""
    lanes = len(OPENINGS)
    plant, way, force = Plant(None, lanes), np.repeat([[0.0], [0.0], [1.0], [-1.0]], lanes, axis=1), np.zeros((1, 2, lanes))
    plant.state[:] = balanced_state(plant.lane_parameters, np.zeros((2, lanes)))
    along = Derivatives(np.zeros_like(plant.state), way, np.zeros_like(force))
    slope = jvp(plant, way * OPENINGS, force, AFTER, along)[at.Y2]
    return {"opening": OPENINGS.tolist(), "moved": plant.state[at.Y2].tolist(), "slope": slope.tolist()}


def _tasks(options: Options) -> dict[Any, Task]:
    plants = {
        name: Task(f"plant{k}", plant_cost, {"lanes": n, "rig": rig}) for k, (name, (n, rig)) in enumerate(PLANTS.items())
    }
    loops = {name: Task(f"loop-{law}", loop_cost, {"law": law}) for name, law in LOOPS.items()}
    trust = {name: Task(name, foretold, {"slides": name == "slide"}) for name in ("slide", "rest")}
    return {**plants, **loops, **trust, "pushed": Task("pushed", pushed, {})}


def _kept(options: Options, found: Found) -> Any:
    return {
        "cost": {name: found[name] for name in (*PLANTS, *LOOPS)},
        "foretold": {name: found[name]["errors"] for name in ("slide", "rest")},
        "pushed": dict(found["pushed"]),
    }


def _shown(content: Content) -> dict[str, str]:
    figures = content["figures"]
    cost = [["", "forward, ms", "with tape, ms", "backward, ms", "(tape + backward) / forward"]]
    for name, one in figures["cost"].items():
        times = [one[part] for part in ("forward", "taped", "backward")]
        cost.append([name, *(digits(1e3 * spent) for spent in times), f"{(times[1] + times[2]) / times[0]:.1f}"])
    heads = (Head(f"change {change:g}", ("median", "90 %")) for change in CHANGES)
    trust: list[list[Cell | Head]] = [["pistons", "after", *heads]]
    for name, errors in figures["foretold"].items():
        for duration in INSTANTS:
            row = [one for one in errors if one["after"] == duration]
            trust.append([name, f"{1e3 * duration:g} ms", *([f"{one['median']:.1g}", f"{one['q90']:.1g}"] for one in row)])
    return {"gradients_cost.md": markdown(cost) + "\n", "gradients_trust.md": markdown(trust) + "\n"}


def _drawn(content: Content, folder: Path) -> list[Path]:
    return friction_figure(content["figures"]["pushed"], AFTER, folder)


UNITS = {
    "forward": "s", "taped": "s", "backward": "s", "after": "s", "change": "1", "median": "1", "q90": "1",
    "opening": "1", "moved": "m", "slope": "m",
}  # fmt: skip
STUDY = Study({}, _tasks, _kept, UNITS, _shown, _drawn, timed=True, beside=(ResidualVectorEnv,))
register(study="gradients", about="what gradients cost, and how far they can be trusted")(STUDY)
