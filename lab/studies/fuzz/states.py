"""Kind of the states of environments, which compiled code goes on from: entries gone, renamed, new, and with odd numbers."""

import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import NUMBERS, Rng, altered
from lab.studies.fuzz.sealed import changed

WORLDS: tuple[dict[str, Any], ...] = (
    {"id": "BirthSIM/Circle-v1", "sensors": "honest", "randomize": True},
    {"id": "BirthSIM/Descent-v1", "sensors": "lab", "randomize": True},
    {"id": "BirthSIM/Circle-v1", "user_force": "guided"},
    {"id": "BirthSIM/CircleResidual-v1", "law": "admittance", "sensors": "lab"},
)
STEPS = 3


def _prepared(_: Path) -> list[tuple[Any, dict[str, Any]]]:
    import agents

    assert agents
    made = []
    for world in WORLDS:
        env: Any = gymnasium.make_vec(num_envs=2, **world)
        env.reset(seed=0)
        env.step(np.zeros(env.action_space.shape))
        state = env.get_state()
        env.set_state(state)
        made.append((env, state))
    return made


def _odd(rng: Rng, array: Any) -> Any:
    """An array of which some entries are odd numbers, as far as its type holds them."""
    array = np.array(array)
    for _ in range(int(rng.integers(1, 4))):
        value = NUMBERS[rng.integers(len(NUMBERS))]
        try:
            with np.errstate(all="ignore"):
                array[(...,) if rng.random() < 0.3 else np.unravel_index(rng.integers(array.size), array.shape)] = value
        except (OverflowError, ValueError):
            pass
    return array


def _state(prepared: list[tuple[Any, dict[str, Any]]], rng: Rng, folder: Path, case: Case) -> None:
    env, good = prepared[rng.integers(len(prepared))]
    state, choice = dict(good), rng.random()
    names = sorted(set(good) - {"plain"})
    chosen = [names[rng.integers(len(names))] for _ in range(int(rng.integers(1, 4)))]
    case.names, case.shown = ("state", "setpoint"), f"{env.spec.id}: {chosen}, {choice:.2f}"
    if choice < 0.6:
        state.update({name: _odd(rng, good[name]) for name in chosen if good[name].size})
    elif choice < 0.8:
        state = {**changed(rng, {name: good[name] for name in names}), "plain": good["plain"]}
    else:
        plain = altered(rng, json.loads(good["plain"].tobytes()))
        state["plain"] = np.frombuffer(json.dumps(plain, default=str).encode(), dtype=np.uint8)
    try:
        env.set_state(state)
        for _ in range(STEPS):
            env.step(np.zeros(env.action_space.shape))
    finally:
        env.set_state(good)


STATES: dict[str, Kind] = {"state": Kind(_prepared, _state)}
