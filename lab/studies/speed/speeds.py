"""Speeds of environments in processes of their own: of this checkout and another in turns, and of first steps.

Every process runs ``stopwatch.py`` under one checkout with ``OMP_NUM_THREADS=1``. Its times are CPU times, which other programs
on the machine disturb least; those of two threads against one are wall times.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

import birthsim_env
from agents.residual.settings import LAWS
from lab.studies.speed import stopwatch

ROUNDS = 3
"""Pairs of processes; what one happens to have (where memory lies, what else runs) the next has not."""

HERE = Path(birthsim_env.__file__).resolve().parent.parent
"""The checkout, or the folder of packages, that this module belongs to."""

CIRCLE, RESIDUAL = "BirthSIM/Circle-v2", "BirthSIM/CircleResidual-v2"


@dataclass(frozen=True)
class Job:
    """What ``stopwatch`` is to measure, under the name of its row; ``alone`` where only this checkout is asked."""

    name: str
    kind: str
    arguments: dict[str, Any] = field(default_factory=dict)
    alone: bool = False

    def in_unit(self, seconds: float) -> tuple[float, str]:
        """The value that a row shows of what was measured, and its unit."""
        if self.kind == "vector_reset" or self.alone:
            return 1e6 * seconds, "us per lane"
        return 1.0 / seconds, "policy steps/s"


def _law_inside(name: str, lanes: int, alone: bool = False, **arguments: Any) -> Job:
    return Job(name, "vector_step", {"environment": RESIDUAL, "lanes": lanes, **arguments}, alone)


SHARED = (
    Job("gym.make step, valve mode", "step", {"environment": CIRCLE}),
    Job("gym.make step, paper's law inside", "step", {"environment": RESIDUAL}),
    _law_inside("gym.make_vec step, paper's law inside, 64 lanes", 64),
    _law_inside("gym.make_vec step, paper's law inside, 256 lanes", 256),
    _law_inside("gym.make_vec step, best law, lab sensors, 256 lanes", 256, law="admittance-backstepping", sensors="lab"),
    *(
        Job(
            f"evaluation, best law, lab sensors, {lanes} lanes",
            "evaluation",
            {"environment": CIRCLE, "law": "admittance-backstepping", "lanes": lanes, "sensors": "lab", "randomize": True},
        )
        for lanes in (64, 256)
    ),
    Job("reset, all randomized, 1024 lanes", "vector_reset", {"environment": CIRCLE, "lanes": 1024, "randomize": True}),
)
"""What every checkout has."""

LANES = tuple(
    _law_inside(f"paper's law inside, {lanes} lanes, one thread", lanes, alone=True, num_threads=1)
    for lanes in (64, 1024, 16384, 65536)
)
"""What a step costs a lane among few and among many."""

THREADS = tuple(
    _law_inside(f"paper's law inside, 1024 lanes, {word}, wall time", 1024, True, num_threads=count, clock="wall")
    for count, word in ((1, "one thread"), (2, "two threads"))
)


class Process:
    """A process of ``stopwatch.py`` under a checkout, to be left with ``with``; ``cache`` is the folder for machine code.

    Where it is not ``prebuilt``, Numba compiles what the package has machine code for.

    Raises ``ValueError`` where the checkout has no ``birthsim_env``.
    """

    def __init__(self, tree: Path, cache: Path | None = None, prebuilt: bool = True) -> None:
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, (str(tree.resolve()), os.environ.get("PYTHONPATH"))))
        # Two checkouts with one folder for machine code would throw out each other's.
        environment.pop("NUMBA_CACHE_DIR", None)
        if cache is not None:
            environment["NUMBA_CACHE_DIR"] = str(cache)
        environment["BIRTHSIM_PREBUILT"] = f"{prebuilt:d}"
        # -P keeps the modules beside the script out of the way.
        line = [sys.executable, "-P", stopwatch.__file__]
        self._tree = tree
        self._process = subprocess.Popen(line, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        try:
            found = Path(self._answer())
            if not found.is_relative_to(tree.resolve()):
                raise ValueError(f"--beside {str(tree)!r} has no birthsim_env; allowed: a checkout of the project")
        except BaseException:
            self.close()
            raise

    def measure(self, kind: str, **arguments: Any) -> float:
        """What ``stopwatch``'s function ``kind`` returns; ``ValueError`` where the checkout cannot do it."""
        assert self._process.stdin is not None
        print(json.dumps({"kind": kind, **arguments}), file=self._process.stdin, flush=True)
        return float(self._answer())

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise ValueError(f"the process that measures {str(self._tree)!r} has ended; its last words are above")
        return json.loads(line)

    def close(self) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.communicate()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, raised: BaseException | None, trace: TracebackType | None) -> None:
        self.close()


def version_of(tree: Path) -> str:
    """The commit of a checkout, with "-dirty" behind it where files have changed since; the folder's name without git."""
    line = ["git", "-C", str(tree), "describe", "--always", "--dirty", "--exclude", "*"]
    try:
        found = subprocess.run(line, capture_output=True, text=True, check=False).stdout.strip()
    except OSError:
        found = ""
    return found or tree.resolve().name


def measured(jobs: tuple[Job, ...], trees: tuple[Path, ...], budget: float) -> dict[tuple[Path, str], float]:
    """Median s per checkout and name of a job over ``ROUNDS`` rounds, which take about ``budget`` s together.

    The checkouts take turns job by job. Jobs that are ``alone`` are done by the first only.
    """
    times: dict[tuple[Path, str], list[float]] = {}
    for number in range(ROUNDS):
        with ExitStack() as stack:
            processes = [(tree, stack.enter_context(Process(tree))) for tree in trees]
            for job in jobs:
                able = processes[:1] if job.alone else processes
                for tree, process in able if number % 2 == 0 else reversed(able):
                    seconds = process.measure(job.kind, budget=budget / ROUNDS, **job.arguments)
                    times.setdefault((tree, job.name), []).append(seconds)
    return {key: float(np.median(spent)) for key, spent in times.items()}


def first_steps() -> Iterator[tuple[str, float]]:
    """CPU s from the start of new processes to the end of a first step: valve mode and all laws, prebuilt, compiled and cached.

    All processes share a folder for machine code, which is empty at the beginning: each compiles what those before it have not,
    where it does without prebuilt code.
    """
    kinds: dict[str, dict[str, Any]] = {"valve mode": {"environment": CIRCLE}}
    for law in LAWS:
        kinds[f"{law} inside, lab sensors"] = {"environment": RESIDUAL, "law": law, "sensors": "lab"}
    with tempfile.TemporaryDirectory() as folder:
        for state in ("prebuilt", "compiled", "cached"):
            for name, arguments in kinds.items():
                with Process(HERE, Path(folder), state == "prebuilt") as process:
                    yield f"{name}, {state}", process.measure("first_step", **arguments)
