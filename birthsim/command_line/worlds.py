"""What commands look at before they begin: the environment, its world, and the controllers' options."""

import sys
from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium

from baselines.controller import RESIDUAL
from baselines.named import known_options, split_options
from birthsim_env.ids import environment_ids
from birthsim_env.physics.rig.values import near
from birthsim_env.registry import names
from birthsim_env.splits import GUIDING, VALIDATION, caution


def check_environment(name: str, residual: bool = False, given: str = "--env") -> None:
    """Raises ``ValueError`` for an id that is none of the experiments, or else of those with a controller inside.

    ``given`` says by what it was given: an option of a command, or ``"environment ="``.
    """
    known = [one for one in environment_ids() if ("Residual" in one) == residual]
    if name not in known:
        whole = f"BirthSIM/{name}"
        asked = near(whole if whole in known else name, known)
        raise ValueError(f"{given} {name!r}{asked}; allowed: {', '.join(known)}")


def check_world(environment: str, **arguments: Any) -> None:
    """Raises ``ValueError`` for arguments with which no episode of an environment begins, before anything else is done."""
    env: Any = gymnasium.make(environment, **arguments)
    try:
        env.reset(seed=0)
    finally:
        env.close()


def warn_of_worlds(controllers: Iterable[str], seed: int, episodes: int) -> None:
    """Say in one line on stderr where the worlds of an evaluation have guided what is judged on them.

    A registered controller as it comes learned on no worlds, so that those of training say of it what others do.
    """
    learned = any(one == RESIDUAL or one not in names("controller") for one in controllers)
    if said := caution(range(seed, seed + episodes), GUIDING if learned else (VALIDATION,)):
        print(f"{sys.argv[0]}: warning: {said}", file=sys.stderr)


def policy_of(environment: str) -> str:
    """Name of the policy that comes with the package for an environment id, where one does: ``BirthSIM/Forceps-v2`` ->
    ``forceps``."""
    return environment.removeprefix("BirthSIM/").rpartition("-v")[0].lower()


def with_options(controllers: Sequence[str], entries: Sequence[str]) -> list[str]:
    """Controllers' names with what ``--set`` gives to those that have it; ``ValueError`` for what none of them has."""
    if not entries:
        return list(controllers)
    known = {name: known_options(name) for name in controllers}
    for entry in entries:
        option, equals, value = entry.partition("=")
        if not (equals and value and option.isidentifier()):
            raise ValueError(f"--set {entry!r}; allowed: GAIN=VALUE")
        if not any(have is None or option in have for have in known.values()):
            listed = "; ".join(f"{name}: {', '.join(have or ()) or 'nothing'}" for name, have in known.items())
            asked = near(option, {one for have in known.values() for one in have or ()})
            raise ValueError(f"--set {entry!r}{asked}; allowed for {listed}")
    found = []
    for name, have in known.items():
        own = [entry for entry in entries if have is None or entry.partition("=")[0] in have]
        plain, given = split_options(name)
        listed = ",".join([*(f"{key}={value}" for key, value in given.items()), *own])
        found.append(f"{plain}[{listed}]" if listed else plain)
    return found
