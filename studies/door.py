"""``birthsim study NAME``: what the project measures of itself and of its controllers; it comes with a clone."""

from __future__ import annotations

import sys
from typing import NamedTuple

from baselines.commands.start import perform
from birthsim_env.physics.rig.values import near, shown
from studies.results import changed


class Study(NamedTuple):
    """Where a study's command is, and what it measures."""

    module: str
    measures: str


STUDIES = {
    "accuracy": Study("accuracy.command", "the error of the plant's integrator, against a second model"),
    "beside-law": Study("residual.beside_law", "policies of several seeds beside the controller that they correct"),
    "comparison": Study("comparison.command", "every controller under all conditions, and how the stiffness feels"),
    "fuzz": Study("fuzz.command", "odd input to everything that is read or called"),
    "haptics": Study("haptics.command", "what a hand feels"),
    "honest": Study("honest.command", "what honest sensors cost"),
    "mutation": Study("mutation.command", "how many small changes of the numerical modules their tests notice"),
    "odd-rigs": Study("fuzz.odd_rigs", "random rigs through every command"),
    "pools": Study("pools", "what other processes and hosts cost"),
    "recovery": Study("recovery.command", "how well identification finds rigs that are known"),
    "scores": Study("scores.command", "what every environment pays to whom"),
    "soak": Study("soak.command", "10^8 policy steps over all scenarios, controllers, sensors and corners of the ranges"),
    "speed": Study("speed.command", "speeds, beside what they are to be compared with"),
    "stability": Study("stability.command", "maps of where a controller is stable"),
    "stiffest": Study("stability.stiffest", "the stiffest setpoints at which the paper's controller rests"),
    "sweep": Study("sweeps.command", "grids, random draws and searches, from a TOML file"),
    "targets": Study("targets.command", "built code of every target, against Python"),
    "verification": Study("verification.command", "balances, coverage and mutation scores, for docs/verification.md"),
    "worst": Study("honest.worst", "the worst worlds, and what each owes to its figures"),
}


def overview() -> str:
    """The help: one line a study."""
    width = max(map(len, STUDIES))
    lines = [f"  {name:{width}}  {study.measures}" for name, study in STUDIES.items()]
    lines += ["", f"  {'status':{width}}  which results/*.json are fresh, and what changed since the others"]
    return "\n".join(["usage: birthsim study NAME ...", "", *lines])


def state(name: str) -> str:
    """Whether the result of a study is of the sources that are here."""
    files = changed(name, f"studies.{STUDIES[name].module}")
    if files is None:
        return "no result in results/"
    return f"stale; changed: {', '.join(files)}" if files else "fresh"


def main(arguments: list[str]) -> None:
    """Run the study that the first argument names; the others are its own."""
    if not arguments or arguments[0] in ("-h", "--help"):
        print(overview())
        raise SystemExit(0 if arguments else 2)
    name, *rest = arguments
    if name == "status":
        print("\n".join(f"{one:12} {state(one)}" for one in STUDIES))
        return
    if name not in STUDIES:
        allowed = ", ".join(["status", *STUDIES])
        print(f"birthsim study: error: NAME = {shown(name)}{near(name, STUDIES)}; allowed: {allowed}", file=sys.stderr)
        raise SystemExit(2)
    sys.argv = ["", *rest]
    perform(f"birthsim study {name}", "studies", STUDIES[name].module)
