"""Entry point of every console command: chooses it by its name, and answers signals before it is loaded.

What a command imports takes seconds. This module imports next to nothing, so that Ctrl-C ends a command in one line from its
first moment on.
"""

from __future__ import annotations

import os
import signal
import sys
from importlib import import_module
from pathlib import Path
from types import FrameType, ModuleType

ENDINGS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "the terminal is gone"}
"""Signal -> what a command says last; the second one ends it at once."""

_ABOVE = {
    **dict.fromkeys(("evaluate", "explain", "export", "scores", "sweep", "train"), "agents"),
    "build": "birthsim_build",
    **dict.fromkeys(("live", "log", "replay"), "birthsim_live"),
    "fmu": "birthsim_build",
}
"""Command -> the package that holds it, where that is not this one."""


def endings() -> dict[int, str]:
    """Number of each signal of ``ENDINGS`` that this system knows -> what a command says last."""
    return {signal.Signals[name].value: said for name, said in ENDINGS.items() if name in signal.Signals.__members__}


def command() -> None:
    """Run the command that the process is called by: ``birthsim-train`` -> ``agents.commands.train``."""
    name = Path(sys.argv[0]).stem
    words = endings()

    def end(number: int, _: FrameType | None) -> None:
        os.write(2, f"{name}: {words[number]}\n".encode())
        os._exit(128 + number)

    for number in words:
        signal.signal(number, end)
    try:
        module = _module(name.removeprefix("birthsim-"))
    except ImportError as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    module.main()


def _module(name: str) -> ModuleType:
    package = _ABOVE.get(name, "baselines")
    if package == "agents":
        # Other distributions have a package of that name too.
        from birthsim_env.learned import from_agents

        module: ModuleType = from_agents(f"commands.{name}")
        return module
    return import_module(f"{package}.commands.{name}")
