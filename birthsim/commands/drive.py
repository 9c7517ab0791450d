"""birthsim drive: a controller on a real rig, or on a simulated one in another process."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from birthsim.command_line.settings import (
    CONTROLLER,
    ENV,
    MANY,
    NAMES,
    SENSORS,
    Configured,
    RigFile,
    Seed,
    Style,
    number,
    whole,
)
from birthsim.rigs import drive

SAFETY, SIMULATED = map(Group.create_ordered, ("Safety", "Simulated rig"))


def check_driver(_: type, name: str) -> None:
    """``simulated``, a registered driver with what it connects to behind a colon, or a class in a file."""
    from birthsim_env.registry import entry  # loads what it looks among

    kind = name.partition(":")[0]
    if kind != "simulated" and not name.rpartition(":")[0].endswith(".py"):
        entry("driver", kind, ", simulated, or path/to/file.py:Class")


@dataclass(kw_only=True)
class Settings(Configured):
    """Run a controller, or an experiment, on a rig behind a driver, in a process of its own: within limits, with a stated end
    at every fault, and with a log that identify reads. Without a rig, --driver simulated has one.

    Read docs/how-to/real_rig.md before air is on. Not a medical device.
    """

    driver: Annotated[str, Parameter(validator=check_driver)] = "simulated"
    """simulated; udp:HOST:PORT; or path/to/file.py:Class, see docs/how-to/real_rig.md."""
    controller: Annotated[str, CONTROLLER, Parameter(help=f"One of {NAMES}")] = "admittance-adaptive"
    plan: Annotated[Path | None, Parameter(metavar="PLAN")] = None
    """Follow an experiment of birthsim identify --propose."""
    env: Annotated[str | None, ENV] = None
    """Follow a scenario's target and stiffness; without it and without a plan the end effector rests where it is."""
    duration: Annotated[float | None, number("S", above=0.0, most=3600.0)] = None
    """Duration. [default: that of plan or scenario, else 10]"""
    ramp: Annotated[float, number("S", least=0.0, most=60.0)] = 1.0
    """Seconds in which the target moves to its start, and valves fade in and out; 0: at once."""
    parameters: RigFile = None
    seed: Seed = 0
    """Seed of the scenario, and of a simulated rig."""
    safety: Annotated[Path | None, Parameter(group=SAFETY, metavar="FILE")] = None
    """TOML file of limits and of what happens at each fault."""
    show_limits: Annotated[bool, Parameter(group=SAFETY)] = False
    """Print limits and what happens at each fault, and end."""
    no_limiter: Annotated[bool, Parameter(group=SAFETY)] = False
    """Drive without the port limiter, which bounds energy and speed."""
    dry_run: Annotated[bool, Parameter(group=SAFETY)] = False
    """Keep the valves closed; asked.csv has the openings that the controller asks for."""
    priority: Annotated[int, whole(0, 99), Parameter(group=SAFETY)] = 0
    """Real-time priority (SCHED_FIFO), if the process may have it; 0: none."""
    rig: Annotated[str | None, Parameter(group=SIMULATED, metavar="FILE")] = None
    """TOML file of the simulated rig. [default: that of --parameters]"""
    sensors: Annotated[str, SENSORS, Parameter(group=SIMULATED)] = "lab"
    """Sensors of the simulated rig."""
    lockstep: Annotated[bool, Parameter(group=SIMULATED)] = False
    """The simulated rig waits for every answer instead of running by the clock."""
    provoke: Annotated[list[str], MANY, Parameter(group=SIMULATED, metavar="KIND@S...")] = field(default_factory=list)
    """Faults of the simulated rig, such as nan-pressure@1.5 or silence@2+0.01."""
    style: Style = "screen"
    out: Path | None = None
    """Folder for log.csv, asked.csv, timing.json and, without --lockstep, the figure timing."""


def main(settings: Settings) -> None:
    """Drive."""
    drive(settings)
