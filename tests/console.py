"""The console commands as a user runs them, for their tests: in a shell, within this process, until Ctrl-C; what they leave."""

from __future__ import annotations

import importlib
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
COMMANDS = {
    "evaluate": "baselines.commands.evaluate",
    "figure4": "baselines.commands.figure4",
    "train": "agents.commands.train",
}
RESIDUAL = "BirthSIM/ProbeResidual-v0"

OWN = """
import numpy as np

class Slam:
    def __init__(self, parameters):
        pass
    def reset(self, lanes=None):
        pass
    def command(self, measurement, reference):
        return np.tile([[0.0], [0.0], [1.0], [-1.0]], measurement.position.shape[1])
"""


def run(command, *arguments):
    """The finished process of a command, in the words of a shell."""
    line = [sys.executable, "-m", COMMANDS[command], *map(str, arguments)]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)


def call(command, monkeypatch, capsys, *arguments):
    """Exit status, what was printed and what was complained about, of a command within this process."""
    monkeypatch.setattr(sys, "argv", [command, *map(str, arguments)])
    status = 0
    try:
        importlib.import_module(COMMANDS[command]).main()
    except SystemExit as end:
        status = end.code
    return status, *capsys.readouterr()


def strict(path):
    """JSON as others read it: without NaN and Infinity."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def assert_picture(folder, name):
    assert (folder / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    assert (folder / f"{name}.png").stat().st_size > 20_000
    assert "<svg" in (folder / f"{name}.svg").read_text()[:1000]


def interrupted(command, arguments, seen):
    """A command that gets Ctrl-C once ``seen(stderr so far)`` is true: the finished process's status and stdout."""
    # A process that a script starts in the background would ignore Ctrl-C.
    program = (
        f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from {COMMANDS[command]} import main; main()"
    )
    line = [sys.executable, "-c", program, *map(str, arguments)]
    process = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0)
    said, until = b"", time.monotonic() + 100
    try:
        while not seen(said.decode(errors="replace")):
            assert time.monotonic() < until, said
            part = process.stderr.read(200)
            assert part, said
            said += part
        process.send_signal(signal.SIGINT)
        printed, rest = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert b"Traceback" not in said + rest
    assert b"leaked" not in said + rest
    return process.returncode, printed.decode()
