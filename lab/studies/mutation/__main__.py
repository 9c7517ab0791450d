"""Mutation tester of the small numerical modules: a changed operator or number in them should make some test fail.

It prints the fraction of mutants killed of each module and the survivors.

Kernels run uncompiled here, so that a mutant needs no compilation: a forked child replaces the code of one function, runs the
tests of its module until one fails, and ends. The tests that are quick enough uncompiled are found by running each once.
An error that compiled code would not raise, such as the root of a negative number, counts as a failure.
"""

import gc
import importlib
import math
import os
import resource
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import pytest
from cyclopts import Parameter

from birthsim.command_line.command import perform_with
from birthsim.command_line.settings import MANY, Configured, number, whole
from birthsim_env.files import write_json
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each
from lab.engine.results import MOST
from lab.studies.mutation.changes import mutants_of
from lab.studies.mutation.modules import MODULES, files_of
from lab.studies.mutation.uncompiled import switch_off

LIMIT = 40.0
"""CPU seconds of one test, uncompiled, beyond which it is left out (``--limit``). The balance of the chambers needs 25."""

BUDGET = 60.0
"""CPU seconds of all tests of one module, the quickest first: what a surviving mutant costs at most (``--budget``)."""

PATIENCE = 3.0
"""A mutant that needs so many times the CPU time of its tests, and five seconds more, is taken to run for ever."""


@dataclass(kw_only=True)
class Settings(Configured):
    """Change an operator or a number of numerical modules: some test should fail."""

    module: Annotated[list[str], MANY, Parameter(choices=tuple(MODULES), metavar="NAME...")] = field(default_factory=list)
    """Modules, else all."""
    every: Annotated[int, whole()] = 1
    """Try only every k-th mutant of a module."""
    limit: Annotated[float, number("S", above=0.0)] = LIMIT
    """CPU seconds of a test."""
    budget: Annotated[float, number("S", above=0.0)] = BUDGET
    """CPU seconds per survivor."""
    before: Path | None = None
    """Report of an earlier run to compare with, mutant by mutant."""
    again: Path | None = None
    """Report of the same sources: after new tests, try only what survived there."""
    out: Path | None = None
    """Where to write the report, as JSON."""


def run_in_child(items: list[pytest.Item], seconds: float, apply: Callable[[], None]) -> tuple[str | None, float]:
    """The first test that fails in a forked child after ``apply``, or "time limit", or None; and the CPU seconds it took."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        try:
            apply()
            for item, following in zip(items, [*items[1:], None], strict=True):
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
                if item.session.testsfailed:
                    os.write(writer, item.nodeid.encode())
                    break
        except BaseException as error:
            os.write(writer, repr(error).encode())
        finally:
            os._exit(0)
    os.close(writer)
    _, status, usage = os.wait4(child, 0)
    with os.fdopen(reader) as pipe:
        said = pipe.read()
    ended = "time limit" if os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL) else "a crash"
    return said or (ended if status else None), usage.ru_utime + usage.ru_stime


def run_here(item: pytest.Item, seconds: float) -> str | None:
    """Why a test does not pass within so many CPU seconds of this process, or None."""
    slow = False

    def stop(*_: object) -> None:
        nonlocal slow
        slow = True
        raise TimeoutError("time limit")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    failed, item.session.testsfailed = item.session.testsfailed, 0
    return ("time limit" if slow else "fails") if failed else None


class Tester:
    """A pytest plugin that runs the collected tests of each module once per mutant."""

    def __init__(self, options: Settings, report: Callable[[str, dict[str, Any]], None]) -> None:
        self.modules, self.every, self.report = options.module or list(MODULES), options.every, report
        self.limit, self.budget = options.limit, options.budget
        self.again = read_json("--again", options.again, Each(dict), MOST) if options.again else {}
        self.measured: dict[str, tuple[str | None, float]] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection(self) -> None:
        """The tests keep their profile, but no failing example is made smaller and slow ones are no fault."""
        from hypothesis import HealthCheck, Phase, settings  # not earlier: pytest wants to import its plugins itself

        phases, checks = (Phase.explicit, Phase.generate), list(HealthCheck)
        settings.register_profile("mutation", settings.default, phases=phases, suppress_health_check=checks)
        settings.load_profile("mutation")

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if session.testsfailed:
            raise session.Interrupted("errors while collecting")
        gc.freeze()  # so that children copy less memory
        for name in self.modules:
            self.report(name, self.examine(importlib.import_module(name), session.items))
        return True

    def select(self, module: str, items: list[pytest.Item]) -> tuple[list[pytest.Item], dict[str, str]]:
        """The tests of a module that pass uncompiled within the limits, and why others are left out."""
        concerned = [item for item in items if item.path.stem.removeprefix("test_") in MODULES[module]]
        for item in concerned:
            if item.nodeid not in self.measured:
                # In this process first: what oracles derive once and keep, every child then inherits.
                refused = run_here(item, self.limit)
                self.measured[item.nodeid] = (refused, 0.0) if refused else run_in_child([item], self.limit, lambda: None)
        chosen, left_out, total = [], {}, 0.0
        for item in sorted(concerned, key=lambda item: self.measured[item.nodeid][1]):
            failed, seconds = self.measured[item.nodeid]
            if failed or total + seconds > self.budget:
                left_out[item.nodeid] = "budget" if not failed else failed if failed == "time limit" else "fails uncompiled"
            else:
                total += seconds
                chosen.append(item)
        return chosen, left_out

    def examine(self, module: ModuleType, items: list[pytest.Item]) -> dict[str, Any]:
        """CPU seconds of the tests and seconds in all; the tests left out; what killed each mutant, None where it survived."""
        started = time.monotonic()
        chosen, left_out = self.select(module.__name__, items)
        cost, kills = {item.nodeid: self.measured[item.nodeid][1] for item in chosen}, Counter[str | None]()
        control, together = run_in_child(chosen, 2 * self.budget + 5, lambda: None)
        if control:
            raise RuntimeError(f"{module.__name__} without a change: {control}")
        earlier = self.again.get(module.__name__, {})
        found = {"tests": earlier.get("tests", {}) | cost, "left_out": left_out, "every": self.every, "mutants": {}}
        for mutant in list(mutants_of(module))[:: self.every]:
            chosen.sort(key=lambda item: cost[item.nodeid] / (1 + kills[item.nodeid]))
            known = earlier.get("mutants", {}).get(mutant.name, {})
            if known.get("change") == mutant.change and known["killed_by"] is not None:
                found["mutants"][mutant.name] = known
                continue
            killer, _ = run_in_child(chosen, PATIENCE * together + 5, mutant.apply)
            kills[killer] += 1
            found["mutants"][mutant.name] = {"line": mutant.line, "change": mutant.change, "killed_by": killer}
        return found | {"seconds": time.monotonic() - started + earlier.get("seconds", 0.0)}


def print_results(module: str, results: dict[str, Any], before: dict[str, Any]) -> None:
    """The fraction of killed mutants, the survivors, and what differs from the mutants ``before``."""
    mutants = results["mutants"]
    alive = [name for name, mutant in mutants.items() if mutant["killed_by"] is None]
    tests = f"{len(results['tests'])} tests, {len(results['left_out'])} left out, {results['seconds']:.0f} s"
    print(f"{module}: {len(mutants) - len(alive)} of {len(mutants)} killed ({1 - len(alive) / len(mutants):.1%}); {tests}")
    for name in alive:
        print(f"    {module.replace('.', '/')}.py:{mutants[name]['line']}: {mutants[name]['change']}  [{name}]")
    for name, mutant in mutants.items():
        was, now = before.get(name, mutant)["killed_by"], mutant["killed_by"]
        if (was is None) != (now is None):
            print(f"    {name}: killed by {was} before, by {now} now")
    sys.stdout.flush()


def main(options: Settings) -> None:
    """Run the tests."""
    before = read_json("--before", options.before, Each(dict), MOST) if options.before else {}
    switch_off()
    found = {}

    def report(module: str, results: dict[str, Any]) -> None:
        found[module] = results
        if options.out:
            write_json(options.out, found)
        print_results(module, results, before.get(module, {}).get("mutants", {}))

    files = sorted({str(path) for module in options.module or MODULES for path in files_of(module)})
    arguments = ["-qq", "-s", "--tb=no", "--no-header", "-m", "not slow", "-p", "no:xdist", "-p", "no:cacheprovider"]
    sys.exit(pytest.main([*arguments, *files], plugins=[Tester(options, report)]))


if __name__ == "__main__":
    perform_with("birthsim study mutation", Settings, main, "birthsim study mutation --every 3")
