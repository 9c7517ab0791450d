"""How a command begins: it answers signals, then it is loaded.

What a command imports takes seconds. This module imports next to nothing, so that Ctrl-C ends a command in one line from its
first moment on.
"""

import os
import signal
import sys
from importlib import import_module
from types import FrameType, ModuleType

ENDINGS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "the terminal is gone"}
"""Signal -> what a command says last; the second one ends it at once."""


def endings() -> dict[int, str]:
    """Number of each signal of ``ENDINGS`` that this system knows -> what a command says last."""
    return {signal.Signals[name].value: said for name, said in ENDINGS.items() if name in signal.Signals.__members__}


def answer_signals(name: str) -> None:
    """From now on a signal ends the process in one line, which ``name`` begins."""
    words = endings()

    def end(number: int, _: FrameType | None) -> None:
        os.write(2, f"{name}: {words[number]}\n".encode())
        os._exit(128 + number)

    for number in words:
        signal.signal(number, end)


def perform(name: str, package: str, module: str, example: str = "") -> None:
    """Run a command that is called by ``name``; its help ends with the example."""
    sys.argv[0] = name
    loaded = load(name, package, module)
    if hasattr(loaded, "Settings"):
        from baselines.commands.command import perform_with

        perform_with(name, loaded.Settings, loaded.main, example)
    else:  # it has commands of its own below it
        loaded.main()


def load(name: str, package: str, module: str) -> ModuleType:
    """A command's module; what cannot be imported ends the process in one line, which ``name`` begins."""
    try:
        if package != "agents":
            return import_module(f"{package}.{module}")
        # Other distributions have a package of that name too.
        from birthsim_env.learned import from_agents

        found: ModuleType = from_agents(f"{package}.{module}")
        return found
    except ImportError as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        raise SystemExit(2) from None
