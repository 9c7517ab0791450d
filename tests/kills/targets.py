"""What is killed: commands with arguments that take seconds."""

from dataclasses import dataclass

SWEEP = """
[base]
environment = "BirthSIM/Probe-v3"
randomize = "scenario"
episodes = 2
seed = {seed}
[grid]
controller = ["backstepping", "pid"]
"rig.mechanics.mass" = [3.0, 4.0]
[[map]]
x = "controller"
y = "rig.mechanics.mass"
"""
SEARCH = """
[base]
environment = "BirthSIM/Probe-v3"
controller = "pid"
randomize = "scenario"
episodes = 2
[search]
trials = 4
batch = 2
"gain.bandwidth" = { from = 20, to = 80, log = true }
"""


@dataclass(frozen=True)
class Target:
    """A command as a user runs it, without ``--out``.

    ``older`` are words of an earlier run in the same folder; it writes ``file``, or into the folder. With ``alone`` one process
    has the folder to itself; with ``partway`` an interrupted run writes results of what is complete; a command that writes
    ``once`` refuses what is there as a whole. ``needs`` are modules that come with no extra of the project.
    """

    line: str
    older: str = ""
    file: str = ""
    alone: bool = False
    partway: bool = False
    once: bool = False
    needs: tuple[str, ...] = ()


TARGETS = {
    "evaluate": Target(
        "evaluate --env BirthSIM/Probe-v3 --controller backstepping pid --episodes 2", "--seed 7", alone=True
    ),
    "comparison": Target(
        "comparison --env BirthSIM/Probe-v3 --sensors ideal --plant nominal randomised --controller backstepping pid "
        "--episodes 2",
        "--seed 7", alone=True,
    ),
    "stability": Target("stability --controller backstepping --map rig --points 2", "--seed 7 --sensors ideal", alone=True),
    "tune": Target("tune --controller pid --lanes 2 --sensors ideal --trials 3", alone=True, partway=True),
    "train": Target("train --config {small} --steps 2048 --seeds 2 --jobs 2", alone=True),
    "sweep": Target("sweep {sweep}", "{older}", alone=True),
    "search": Target("sweep {search}", alone=True),
    "onnx": Target("export --to onnx circle", file="policy.onnx"),
    "fmu": Target("export --to fmu", file="rig.fmu"),
    "c": Target("export --to c", "--controller pid"),
    "parquet": Target("export --to parquet {evaluation}", file="log.parquet"),
    "mcap": Target("export --to mcap {evaluation}", file="log.mcap"),
    "minari": Target(
        "export --to minari --env BirthSIM/Probe-v3 --level random --episodes 12", once=True, needs=("minari", "h5py")
    ),
    "explain": Target("explain --no-pushes", "--policy descent"),
    "run": Target("run", "--seed 7"),
    "figure4": Target("figure4", "--controller pid"),
    "animate": Target("animate --begin 0.5 --end 1.5 --rate 10", "--seed 7", file="pair.webp"),
}  # fmt: skip
