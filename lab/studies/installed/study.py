"""Every command of README and of the site, from the wheel alone, in an empty home, each page in an empty folder of its own."""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
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
from lab.studies.installed.inputs import MADE, TEXTS, classes, lacking
from lab.studies.installed.pages import commands, pages, python

PATIENCE = 120.0
"""s within which a command has to end after Ctrl-C; assumed."""

INTERRUPTED = 128 + signal.SIGINT
"""The exit status of a command that Ctrl-C ends in order; a program without an order of its own dies of the signal."""

INSTALLATION = 3600.0
"""s that the installation may take; assumed."""

PORT = 8765
"""Of the page, where ``birthsim live`` gets one; assumed to be free."""


class Trial:
    """What a user types, in an environment that has the wheel alone; after ``longest`` s comes Ctrl-C."""

    def __init__(self, folder: Path, longest: float) -> None:
        self._folder, self._longest = folder, longest
        self.rows: dict[str, list[float]] = {}
        (folder / "home").mkdir()
        path = f"{folder / 'venv' / 'bin'}:{os.environ['PATH']}"
        self._variables = {"HOME": str(folder / "home"), "PATH": path, "MPLBACKEND": "agg"}

    @contextmanager
    def place(self, page: str) -> Iterator[Path]:
        """An empty folder with the examples of a clone."""
        here = self._folder / re.sub(r"\W", "_", page)
        here.mkdir()
        shutil.copytree(ROOT / "examples", here / "examples", ignore=shutil.ignore_patterns("__pycache__"))
        yield here

    def step(self, page: str, command: list[str], here: Path, longest: float | None = None) -> None:
        """One command: its seconds and its exit status."""
        began = time.perf_counter()
        quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "stdin": subprocess.DEVNULL}
        serves = command[:2] == ["birthsim", "live"] and "--static" not in command
        asked = [*command, "--port", str(PORT)] if serves else command
        with subprocess.Popen(asked, cwd=here, env=self._variables, **quiet) as process:
            status = _served(process) if serves else _ended(process, longest or self._longest)
        self.rows[f"{page}\t{shlex.join(command)}"] = [time.perf_counter() - began, status]

    def page(self, path: Path) -> None:
        """All commands of a page; README's Python too, which the tests run for the others."""
        name, text = path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
        shown = commands(text)
        if not shown:
            return
        with self.place(name) as here:
            if name == "README.md":
                (here / "readme.py").write_text("\n".join(python(text)), encoding="utf-8")
                self.step(name, ["python", "readme.py"], here)
            for command in shown:
                for file in lacking(command, here):
                    for made in MADE.get(file, ()):
                        self.step(name, shlex.split(made), here)
                    if written := {**TEXTS, **classes()}.get(file):
                        (here / file).write_text(written, encoding="utf-8")
                self.step(name, command, here)


def _ended(process: subprocess.Popen[bytes], longest: float) -> int:
    try:
        return process.wait(longest)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
    try:
        status = process.wait(PATIENCE)
        return INTERRUPTED if status == -signal.SIGINT else status
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def _served(process: subprocess.Popen[bytes]) -> int:
    """Serve until the page answers; then Ctrl-C, after which a server ends in order."""
    while process.poll() is None:
        try:
            with urlopen(f"http://127.0.0.1:{PORT}/", timeout=1) as page:
                found = b"BirthSIM" in page.read()
            process.send_signal(signal.SIGINT)
            return 0 if process.wait() in (0, INTERRUPTED) and found else 1
        except (URLError, ConnectionError, TimeoutError):
            time.sleep(0.05)  # s between two looks
    return int(process.returncode)


def trial(extras: str, longest: float) -> Result:
    """Seconds and exit status of each step, in their order: the installation, README, the site's pages."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        build = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", name, str(ROOT)]
        subprocess.run(build, check=True, stdout=subprocess.DEVNULL)
        wheel = next(folder.glob("birthsim-*.whl"))
        subprocess.run([sys.executable, "-m", "venv", str(folder / "venv")], check=True)
        trial = Trial(folder, longest)
        install = ["pip", "install", "-c", str(ROOT / "constraints.txt"), f"{wheel}[{extras}]"]
        trial.step("", install, folder, INSTALLATION)
        trial.step("", ["birthsim", "doctor"], folder)
        for page in pages():
            trial.page(page)
        found = {row.replace(f"{ROOT}/", "").replace(f"{name}/", ""): values for row, values in trial.rows.items()}
    return {"rows": found}


def _tasks(options: Options) -> dict[Any, Task]:
    return {"": Task("installed", trial, {"extras": options.extras, "longest": options.longest})}


def _shown(content: Content) -> dict[str, str]:
    longest = content["settings"].get("longest", 0.0)  # a result of README alone has none
    rows = [["page", "command", "s", "outcome"]]
    for row, (seconds, status) in content["figures"]["rows"].items():
        page, _, command = row.rpartition("\t")
        ended = {0: "ok", INTERRUPTED: f"Ctrl-C after {longest:.0f} s, ended in order"}
        rows.append([page, f"`{command}`", f"{seconds:.0f}", ended.get(int(status), f"exit status {status:g}")])
    return {"installed.md": markdown(rows) + "\n"}


STUDY = Study(
    {"extras": "agents,live,build,log,onnx,tune", "longest": 60.0},
    _tasks,
    the_only_one,
    {"rows": "s, exit status"},
    _shown,
    timed=True,
    words={"extras": "of the installation", "longest": "after which comes Ctrl-C, in s"},
)
register(study="installed", about="every command of README and site, from the wheel alone")(STUDY)
