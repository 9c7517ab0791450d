"""How a command begins: it answers signals, then it is loaded.

What a command imports takes seconds. This module imports next to nothing, so that Ctrl-C ends a command in one line from its
first moment on.
"""

import os
import signal
import sys
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


def perform(name: str, command: ModuleType, example: str = "") -> None:
    """Run a command's module, which is called by ``name``; its help ends with the example."""
    sys.argv[0] = name
    if hasattr(command, "Settings"):
        from birthsim.command_line.command import perform_with

        perform_with(name, command.Settings, command.main, example)
    else:  # it has commands of its own below it
        command.main()
