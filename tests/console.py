"""The console commands as a user runs them, for their tests: in a shell, within this process, until Ctrl-C; what they leave."""

import importlib
import json
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
STUDIES = {
    *("comparison", "stiffness", "stability", "speed", "accuracy", "haptics", "sweep"),
    *("scores", "beside-law", "own-motion", "worst", "pools", "air", "responses"),
}
"""Studies of ``birthsim study``, which tests run."""
PATIENCE = 600.0  # s; only a state that never comes takes so long
RESIDUAL = "BirthSIM/ProbeResidual-v3"

OWN = """
import numpy as np

class Held:
    openings = 0.0, 0.0, 0.0, 0.0
    def __init__(self, parameters):
        pass
    def reset(self, lanes=None):
        pass
    def command(self, measurement, reference):
        return np.repeat(np.transpose([self.openings]), measurement.position.shape[1], axis=1)

class Slam(Held):
    openings = 0.0, 0.0, 1.0, -1.0

class Out(Held):
    openings = 1.0, -1.0, 1.0, -1.0
"""
"""A file of controllers that hold the valves where they are."""


def words(command):
    return ["birthsim", "study", command] if command in STUDIES else ["birthsim", command]


def run(command, *arguments):
    """The finished process of a command, in the words of a shell."""
    line = [sys.executable, "-m", *words(command), *map(str, arguments)]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)


def call(command, monkeypatch, capsys, *arguments):
    """Exit status, what was printed and what was complained about, of a command within this process."""
    monkeypatch.setattr(sys, "argv", [*words(command), *map(str, arguments)])
    monkeypatch.setenv("NO_COLOR", "1")  # Python 3.14 colours what argparse says
    monkeypatch.setattr("birthsim.main.answer_signals", lambda name: None)
    main = importlib.import_module("birthsim.main").main
    status = 0
    try:
        main()
    except SystemExit as end:
        status = end.code or 0
    printed, complained = capsys.readouterr()
    # The first process with an empty cache says that it compiles.
    return status, printed, re.sub(r"(?m)^BirthSIM: compiling .*\n", "", complained)


def strict(path):
    """JSON as others read it: without NaN and Infinity."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def assert_says(parts, line):
    """A refusal names the option, the value and what is allowed: ``parts`` of its line."""
    missing = [part for part in ((parts,) if isinstance(parts, str) else parts) if part not in line]
    assert missing == [], line


def assert_picture(folder, name):
    assert (folder / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    assert (folder / f"{name}.png").stat().st_size > 5_000
    assert "<svg" in (folder / f"{name}.svg").read_text()[:1000]


def interrupted(command, arguments, reached, ending=signal.SIGINT):
    """A command that gets Ctrl-C, or another signal, once ``reached()`` is true: the finished process's status and stdout."""
    line = [sys.executable, "-m", *words(command), *map(str, arguments)]
    # Files hold whatever the command says before anybody reads it; pipes would fill up.
    with tempfile.TemporaryFile("w+", encoding="utf-8") as stdout, tempfile.TemporaryFile("w+", encoding="utf-8") as stderr:
        with subprocess.Popen(line, cwd=ROOT, stdout=stdout, stderr=stderr) as process:
            try:
                until = time.monotonic() + PATIENCE
                while not reached() and process.poll() is None and time.monotonic() < until:
                    time.sleep(0.02)
                process.send_signal(ending)
                process.wait(PATIENCE)
            finally:
                process.kill()
        printed, said = (file.seek(0) or file.read() for file in (stdout, stderr))
    assert reached(), said
    assert "Traceback" not in said
    assert "leaked" not in said
    return process.returncode, printed
