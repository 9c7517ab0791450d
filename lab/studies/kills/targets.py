"""What is killed: commands with arguments that take seconds, and which files may differ from run to run."""

import tomllib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]

INPUTS = Path(__file__).resolve().parent / "inputs"


@dataclass(frozen=True)
class Target:
    """A command as a user runs it.

    ``arguments`` hold ``{out}``, where it writes: a folder, or ``file`` in one; and ``{inputs}``, the folder of TOML files.
    ``older`` are arguments that take the place of ``first``, as those of an earlier run in the same folder. ``differ`` has
    patterns of files, and ``costs`` keys of JSON files in subfolders, that differ from run to run. With ``alone`` one process
    has the folder to itself: a second one says so and ends. With ``partway`` an interrupted run writes results of what is
    complete. A command that writes ``once`` refuses what is there as
    a whole already. ``needs`` are modules that come with no extra of the project.
    """

    name: str
    command: str
    arguments: tuple[str, ...]
    first: tuple[str, ...] = ()
    older: tuple[str, ...] = ()
    file: str = ""
    differ: tuple[str, ...] = ()
    costs: tuple[str, ...] = ()
    alone: bool = False
    partway: bool = False
    once: bool = False
    needs: tuple[str, ...] = ()

    def missing(self) -> list[str]:
        """What it needs and this environment lacks."""
        return [name for name in self.needs if find_spec(name) is None]

    def line(self, folder: Path, older: bool = False) -> list[str]:
        """The words after the command's name."""
        words = (*(self.older if older else self.first), *self.arguments)
        return [word.format(out=folder / self.file, inputs=INPUTS) for word in words]


TARGETS = {
    target.name: target
    for target in (
        Target(
            "evaluate",
            "birthsim evaluate",
            ("--env", "BirthSIM/Probe-v2", "--controller", "backstepping", "pid", "--episodes", "2", "--out", "{out}"),
            older=("--seed", "7"),
            differ=("times.json",),
            costs=("cost", "sha256"),
            alone=True,
        ),
        Target(
            "compare",
            "birthsim study comparison",
            (
                *("--env", "BirthSIM/Probe-v2", "--sensors", "ideal", "--plant", "nominal", "randomised"),
                *("--controller", "backstepping", "pid", "--episodes", "2", "--out", "{out}"),
            ),
            older=("--seed", "7"),
            costs=("cost", "sha256"),
            alone=True,
        ),
        Target(
            "stability",
            "birthsim study stability",
            ("--controller", "backstepping", "--map", "rig", "--points", "2", "--out", "{out}"),
            older=("--seed", "7", "--sensors", "ideal"),
            alone=True,
        ),
        Target(
            "tune",
            "birthsim tune",
            ("--controller", "pid", "--lanes", "2", "--sensors", "ideal", "--trials", "3", "--out", "{out}"),
            alone=True,
            partway=True,
        ),
        Target(
            "train",
            "birthsim train",
            ("--config", "{inputs}/train.toml", "--steps", "2048", "--seeds", "2", "--jobs", "2", "--out", "{out}"),
            differ=("checkpoint.safetensors", "events.*"),
            costs=("seconds", "environment_fraction", "split"),
            alone=True,
        ),
        Target("export", "birthsim export", ("--to", "onnx", "circle", "--out", "{out}"), file="policy.onnx"),
        Target("fmu", "birthsim export", ("--to", "fmu", "--out", "{out}"), file="rig.fmu"),
        Target("build", "birthsim export", ("--to", "c", "--out", "{out}"), older=("--controller", "pid")),
        Target(
            "parquet", "birthsim export", ("--to", "parquet", "lab/leaderboard/pid.json", "--out", "{out}"), file="log.parquet"
        ),
        Target("mcap", "birthsim export", ("--to", "mcap", "lab/leaderboard/pid.json", "--out", "{out}"), file="log.mcap"),
        Target(
            "minari",
            "birthsim export",
            ("--to", "minari", "--env", "BirthSIM/Probe-v2", "--level", "random", "--episodes", "12", "--out", "{out}"),
            needs=("minari", "h5py"),
            once=True,
        ),
        Target("explain", "birthsim explain", ("--no-pushes", "--out", "{out}"), older=("--policy", "descent")),
        Target("run", "birthsim run", ("--out", "{out}"), older=("--seed", "7")),
        Target("figure4", "birthsim figure4", ("--out", "{out}"), older=("--controller", "pid")),
        Target(
            "sweep",
            "birthsim study sweep",
            ("--out", "{out}"),
            first=("{inputs}/sweep.toml",),
            older=("{inputs}/older.toml",),
            costs=("cost", "sha256"),
            alone=True,
        ),
        Target(
            "search",
            "birthsim study sweep",
            ("{inputs}/search.toml", "--out", "{out}"),
            differ=("trials.journal",),
            costs=("cost", "sha256"),
            alone=True,
        ),
        Target(
            "animate",
            "birthsim animate",
            ("--begin", "0.5", "--end", "1.5", "--rate", "10", "--out", "{out}"),
            older=("--seed", "7"),
            file="pair.webp",
        ),
    )
}


def program(command: str) -> str:
    """Python source that runs a command by the entry point that ``pyproject.toml`` gives it."""
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    script, *words = command.split()
    module, _, function = scripts[script].partition(":")
    return f"import sys; sys.argv[:1] = {[script, *words]!r}; from {module} import {function}; {function}()"
