"""What a user of the wheel alone finds: README's commands, from an empty folder, in an empty home, each in its turn."""

import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.error import URLError
from urllib.request import urlopen

from baselines.work.tasks import Result, Task
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Options, Study, the_only_one
from lab.engine.tables import markdown

LONGEST = 3600.0
"""s that a command may take; assumed."""

PORT = 8765
"""Of the page, where ``birthsim live`` gets one; assumed to be free."""

INPUTS = ("birthsim identify --propose plan.csv", "birthsim identify --simulate plan.csv --out log.csv")
"""What makes the log that README's command takes from a laboratory."""


def readme() -> tuple[list[str], str]:
    """README's commands under "Use it", without their comments, and its Python."""
    text = (ROOT / "README.md").read_text(encoding="utf-8").split("## Use it")[1].split("\n## ")[0]
    commands = [line.partition("  #")[0].strip() for line in text.splitlines() if line.startswith("    birthsim ")]
    return commands, text.split("```python\n")[1].split("```")[0]


def _served(command: list[str], place: dict[str, Any]) -> int:
    """Serve until the page answers; then Ctrl-C, after which a server ends in order."""
    with subprocess.Popen([*command, "--port", str(PORT)], **place) as server:
        while server.poll() is None:
            try:
                with urlopen(f"http://127.0.0.1:{PORT}/", timeout=1) as page:
                    found = b"BirthSIM" in page.read()
                server.send_signal(signal.SIGINT)
                return 0 if server.wait() in (0, 128 + signal.SIGINT) and found else 1
            except (URLError, ConnectionError, TimeoutError):
                time.sleep(0.05)  # s between two looks
        return int(server.returncode)


def trial(extras: str) -> Result:
    """Seconds and exit status of each step, in their order: the installation, README's Python, its commands."""
    rows: dict[str, list[float]] = {}
    with TemporaryDirectory() as folder:
        home, here, own = Path(folder) / "home", Path(folder) / "empty", Path(folder) / "venv"
        home.mkdir()
        here.mkdir()
        variables = {"HOME": str(home), "PATH": f"{own / 'bin'}:{os.environ['PATH']}", "MPLBACKEND": "agg"}
        quiet: dict[str, Any] = {"cwd": here, "env": variables, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}

        def step(name: str, command: list[str], serves: bool = False) -> None:
            began = time.perf_counter()
            status = _served(command, quiet) if serves else subprocess.call(command, timeout=LONGEST, **quiet)
            rows[name] = [time.perf_counter() - began, status]

        build = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, str(ROOT)]
        subprocess.run(build, check=True, stdout=subprocess.DEVNULL)
        wheel = next(Path(folder).glob("birthsim-*.whl"))
        subprocess.run([sys.executable, "-m", "venv", str(own)], check=True)
        step(f"pip install birthsim[{extras}]", ["pip", "install", "-c", str(ROOT / "constraints.txt"), f"{wheel}[{extras}]"])
        commands, python = readme()
        (here / "readme.py").write_text(python, encoding="utf-8")
        (here / "examples").mkdir()
        shutil.copy(ROOT / "examples" / "pd.py", here / "examples")
        step("birthsim doctor", ["birthsim", "doctor"])
        step("README's Python", ["python", "readme.py"])
        for command in commands:
            if command.startswith("birthsim identify"):
                for made in INPUTS:
                    step(made, shlex.split(made))
            step(command, shlex.split(command), serves=command.startswith("birthsim live"))
    return {"rows": rows}


def _tasks(options: Options) -> dict[Any, Task]:
    return {"": Task("installed", trial, {"extras": options.extras})}


def _shown(content: Content) -> dict[str, str]:
    rows = [["command", "s", "outcome"]]
    for command, (seconds, status) in content["figures"]["rows"].items():
        rows.append([f"`{command}`", f"{seconds:.0f}", "ok" if not status else f"exit status {status:g}"])
    return {"installed.md": markdown(rows) + "\n"}


STUDY = Study(
    {"extras": "agents,live,build"},
    _tasks,
    the_only_one,
    {"rows": "s, exit status"},
    _shown,
    timed=True,
    words={"extras": "of the installation"},
)
register(study="installed", about="README's commands, from the wheel alone in an empty home")(STUDY)
