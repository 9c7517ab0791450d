"""Entry point of ``birthsim``: chooses a command by its name, and answers signals before it is loaded.

What a command imports takes seconds. This module imports next to nothing, so that ``birthsim --help`` is quick and Ctrl-C ends
a command in one line from its first moment on.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import NamedTuple

from birthsim.command_line.start import answer_signals, perform
from birthsim.shadows import check_shadows


class Command(NamedTuple):
    """A module of ``birthsim.commands``: what it does, and an example's arguments."""

    does: str
    example: str


GROUPS: dict[str, dict[str, Command]] = {
    "see": {
        "run": Command("one episode: its errors printed, its motion drawn", "--env BirthSIM/Probe-v3 --out out/run"),
        "live": Command("the rig in the browser; --replay plays a recording", "--compare admittance"),
        "figure4": Command("the experiment of the paper's Fig. 4", "--out out/figure4"),
        "animate": Command("two controllers beside each other, moving", "--seed 1 --out out/forceps.webp"),
    },
    "measure": {
        "evaluate": Command(
            "controllers over seeded episodes, with tables", "--controller backstepping pid --out out/evaluation"
        ),
        "score": Command("a policy of any library on the benchmark", "residual:circle --out out/score"),
        "tune": Command("a search for a controller's gains", "--controller pid --trials 75 --out out/tune"),
        "identify": Command("parameters of your own rig, from its log", "log.csv --out rig.toml"),
        "compare": Command("a log beside models of its rig: where each departs", "log.csv --parameters rig.toml"),
        "study": Command("the project's own measurements, in a clone", "speed"),
    },
    "learn": {
        "train": Command("policies by PPO, SAC and others, or by gradients", "--config circle --seeds 5 --out out/circle"),
        "distill": Command("policies with a memory, from teachers that know the rig", "--teacher out/told --out out/students"),
        "explain": Command("what a trained residual has learned", "--policy circle --no-pushes --out out/explain"),
    },
    "use elsewhere": {
        "drive": Command("a controller on a real rig, within limits", "--driver simulated --duration 3 --out out/drive"),
        "export": Command("policies, closed loops and logs in other formats", "--to wasm --out out/wasm"),
    },
    "this machine": {
        "doctor": Command("what works here, and what to install for the rest", ""),
        "warmup": Command("compile in advance what is not prebuilt", ""),
    },
}
"""Group -> command, the name of its module -> what it is. It is documented in docs/reference/commands."""

COMMANDS = {name: command for group in GROUPS.values() for name, command in group.items()}


def main() -> None:
    """Run the command that the first argument names."""
    name, *rest = sys.argv[1:] or ["--help"]
    answer_signals(f"birthsim {name}" if name in COMMANDS else "birthsim")
    if name in ("-h", "--help"):
        print(overview())
        return
    if name == "--version":
        from birthsim_env import __version__

        print(f"birthsim {__version__}")
        return
    if name not in COMMANDS:
        from birthsim_env.physics.rig.values import near, shown

        asked = near(name, COMMANDS)
        allowed = "what birthsim --help lists" if asked else ", ".join(COMMANDS)
        print(f"birthsim: error: command = {shown(name)}{asked}; allowed: {allowed}", file=sys.stderr)
        raise SystemExit(2)
    sys.argv[1:] = rest
    perform(f"birthsim {name}", load(name), f"birthsim {name} {COMMANDS[name].example}".rstrip())


def load(name: str) -> ModuleType:
    """A command's module; what cannot be imported ends the process in one line."""
    try:
        if name != "doctor":  # which says what is wrong
            check_shadows()
        return import_module(f"birthsim.commands.{name}")
    except ImportError as error:
        print(f"birthsim {name}: error: {error}", file=sys.stderr)
        raise SystemExit(2) from None


def overview() -> str:
    """What ``birthsim --help`` says, in 80 columns."""
    lines = [
        "usage: birthsim COMMAND ...",
        "",
        "BirthSIM, a simulator and benchmark of a pneumatic haptic interface.",
    ]
    for title, group in GROUPS.items():
        lines += ["", f"{title}:", *(f"  {name:9} {command.does}" for name, command in group.items())]
    return "\n".join(
        [*lines, "", "birthsim COMMAND --help lists a command's options.", f"example: birthsim run {COMMANDS['run'].example}"]
    )
