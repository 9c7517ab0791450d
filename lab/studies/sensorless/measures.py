"""What a hand feels of rigs that differ from lane to lane: how it is pushed away, held, felt at 1 Hz, and let go."""

from typing import Any

import numpy as np

from baselines.bench.evaluation import evaluate
from baselines.bench.statistics import penalize_lost
from baselines.work.tasks import Result
from birthsim_env.assembly import Arguments
from birthsim_env.loop.signals import Reference
from birthsim_env.parts.scenarios import environment_id, studied_scenarios
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.haptics.recording import record
from lab.studies.haptics.release import flight
from lab.studies.haptics.worlds import POSES, Condition, lost_lanes
from lab.studies.held import hold
from lab.studies.shaken import STIFFNESS, at_rest, shaken
from lab.studies.stability.rig_port import Hand, RigPort

PULLS, PULLED_AT = (190.0, 241.0), 4000.0
"""N along x, and the stiffness setpoint, N/m: the strongest forceps pull asked for, and almost all that cylinder 2 can hold."""

REST, RATE, FULL, LET_GO, AFTER = 1.0, 95.0, 1.5, 0.010, 2.0
"""s, N/s, s, s and s: a hand that comes after a rest, pulls, holds, and lets go; what is watched after that."""


def measure(
    controller: str, source: str, rig: dict[str, Any], sensors: str, force_sensor: bool, seed: int, lanes: int
) -> Result:
    """Of worlds with the seeds ``seed`` on, lists over them by names of ``COLUMNS`` and scenarios; ``rig`` is as believed."""
    return felt(Condition(controller, Parameters.from_dict(rig), sensors, seed, lanes, force_sensor))


def felt(condition: Condition) -> Result:
    """Of the worlds of a condition, lists as those of ``measure``."""
    found = {**_episodes(condition), **_clamped(condition)}
    port = condition.sensors, condition.seed, condition.force_sensor
    found["noticed"] = shaken(condition.law(), condition.drawn(), *port)["noticed"]
    pulled = [_pulled(condition, pull) for pull in PULLS]
    found["overshoot"] = np.concatenate([one["overshoot"] for one in pulled])
    found["lost"] = np.concatenate([found["lost"], *(one["lost"] for one in pulled)])
    return {name: np.asarray(values, dtype=np.float64).tolist() for name, values in found.items()}


def _episodes(condition: Condition) -> dict[str, Any]:
    """Of all scenarios, each of which draws what it asks for: settled errors, and what the push of ``probe`` tells."""
    worlds: Arguments = {"sensors": condition.sensors, "randomize": True, "parameters": condition.rig}
    who, count, seed = condition.controller, condition.rigs, condition.seed
    episodes = {
        name: evaluate(environment_id(name), condition.law(), who, count, seed, progress=False, **worlds)
        for name in studied_scenarios()
    }
    probe = episodes["probe"].metrics
    return {
        "stiffness_error": np.abs(probe["stiffness_error"]), "air": probe["air"],
        "hunting": np.fmax(probe["hunting_x"], probe["hunting_y"]),
        **{name: penalize_lost(one.metrics["settled_rms"], one.lost) for name, one in episodes.items()},
        "lost": np.concatenate([one.lost for one in episodes.values()]),
    }  # fmt: skip


def _port(condition: Condition, places: Any, stiffness: float) -> tuple[RigPort, list[Parameters], Reference]:
    rigs = condition.drawn()
    reference = at_rest(len(rigs), places, stiffness)
    return condition.port(condition.law(), rigs, reference), rigs, reference


def _clamped(condition: Condition) -> dict[str, Any]:
    port, _, reference = _port(condition, POSES, STIFFNESS)
    felt = hold(port, reference)
    return {
        "clamped_mm": 1e3 * felt["motion"], "clamped_N": felt["force"], "clamped_air": felt["air"], "turns": felt["turns"],
    }  # fmt: skip


def _pulled(condition: Condition, size: float) -> dict[str, Any]:
    port, rigs, reference = _port(condition, [(0.45, 0.05)], PULLED_AT)
    free = REST + size / RATE + FULL + LET_GO

    def pull(now: float, position: Array, velocity: Array) -> Array:
        force = np.zeros_like(position)
        force[0] = size * max(0.0, min((now - REST) * RATE / size, 1.0, (free - now) / LET_GO))
        return force

    hand: Hand = pull
    recording = record(port, hand, free + AFTER)
    after = flight(recording, reference.position, free)
    return {"overshoot": 1e3 * after["overshoot"], "lost": lost_lanes(port, rigs)}
