"""Entry point of ``birthsim``: chooses a command by its name, and answers signals before it is loaded.

What a command imports takes seconds. This module imports next to nothing, so that ``birthsim --help`` is quick and Ctrl-C ends
a command in one line from its first moment on.
"""

import sys
from typing import NamedTuple

from baselines.commands.start import answer_signals, perform


class Command(NamedTuple):
    """Where a command is (package, its module), what it does, and what a user may type."""

    package: str
    module: str
    does: str
    example: str


GROUPS: dict[str, dict[str, Command]] = {
    "see": {
        "run": Command("birthsim", "run", "one episode: its figures printed, its motion drawn",
            "run --env BirthSIM/Probe-v2 --out out/run"),
        "live": Command("birthsim_live", "commands.live", "the rig in the browser; --replay plays a recording",
            "live --compare admittance"),
        "figure4": Command("baselines", "commands.figure4", "the experiment of the paper's Fig. 4",
            "figure4 --out out/figure4"),
        "animate": Command("baselines", "commands.animate", "two controllers beside each other, moving",
            "animate --seed 1 --out out/forceps.webp"),
    },
    "measure": {
        "evaluate": Command("baselines", "commands.evaluate", "controllers over seeded episodes, with tables",
            "evaluate --controller backstepping pid --out out/evaluation"),
        "tune": Command("baselines", "commands.tune", "a search for a controller's gains",
            "tune --controller pid --trials 75 --out out/tune"),
        "identify": Command("baselines", "commands.identify", "a laboratory's own rig, from its log",
            "identify log.csv --out rig.toml"),
        "study": Command("birthsim", "study", "studies of the project, in a clone",
            "study speed"),
    },
    "learn": {
        "train": Command("baselines", "commands.train", "policies by PPO, SAC, TQC or gradients",
            "train --config circle --seeds 5 --out out/circle"),
        "distill": Command("agents", "commands.distill", "policies with a memory, from teachers that know the rig",
            "distill --teacher out/told --out out/students"),
        "explain": Command("agents", "commands.explain", "what a trained residual has learned",
            "explain --policy circle --no-pushes --out out/explain"),
    },
    "use elsewhere": {
        "export": Command("birthsim", "export", "policies, loops and logs in other forms",
            "export --to wasm --out out/wasm"),
    },
    "this machine": {
        "doctor": Command("birthsim", "doctor", "what works here, and what to install",
            "doctor"),
        "warmup": Command("birthsim", "warmup", "compile ahead what commands need first",
            "warmup"),
    },
}  # fmt: skip
"""Group -> command -> where it is. Whatever is listed here is documented in docs/reference/commands."""

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
    package, module, _, example = COMMANDS[name]
    perform(f"birthsim {name}", package, module, f"birthsim {example}")


def overview() -> str:
    """What ``birthsim --help`` says, in 80 columns."""
    lines = [
        "usage: birthsim COMMAND ...",
        "",
        "BirthSIM, a pneumatic haptic interface: rig, controllers, measures.",
    ]
    for title, group in GROUPS.items():
        lines += ["", f"{title}:", *(f"  {name:9} {command.does}" for name, command in group.items())]
    return "\n".join(
        [*lines, "", "birthsim COMMAND --help has a command's options.", f"example: birthsim {COMMANDS['run'].example}"]
    )
