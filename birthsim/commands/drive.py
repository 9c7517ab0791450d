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
    number,
    whole,
)
from birthsim.rigs import drive

SAFETY, SIMULATED = map(Group.create_ordered, ("Safety", "Simulated rig"))


@dataclass(kw_only=True)
class Settings(Configured):
    """Run a controller, or an experiment, on a rig behind a driver, in a process of its own: within limits, with a stated end
    at every fault, and with a log that identify reads. Without a rig, --driver simulated has one.

    Read docs/how-to/real_rig.md before air is on. Not a medical device.
    """

    driver: str = "simulated"
    """simulated; udp:HOST:PORT; or path/to/file.py:Class, see docs/how-to/real_rig.md."""
    controller: Annotated[str, CONTROLLER, Parameter(help=f"One of {NAMES}")] = "admittance-adaptive"
    plan: Annotated[Path | None, Parameter(metavar="PLAN")] = None
    """Follow an experiment of birthsim identify --propose."""
    env: Annotated[str | None, ENV] = None
    """Follow a scenario's target and stiffness; without it and without a plan the end effector rests where it is."""
    duration: Annotated[float | None, number("S", above=0.0, most=3600.0)] = None
    """Duration, else that of plan or scenario, else 10 s."""
    ramp: Annotated[float, number("S", least=0.0, most=60.0)] = 1.0
    """Seconds in which the target is led to its start, and valves fade in and out; 0: at once."""
    parameters: RigFile = None
    seed: Seed = 0
    """Of the scenario, and of a simulated rig."""
    safety: Annotated[Path | None, Parameter(group=SAFETY, metavar="FILE")] = None
    """TOML file of limits and of what happens at each fault."""
    show_limits: Annotated[bool, Parameter(group=SAFETY)] = False
    """Print limits and what happens at each fault, and end."""
    no_limiter: Annotated[bool, Parameter(group=SAFETY)] = False
    """Leave the port limiter out, which bounds energy and speed."""
    dry_run: Annotated[bool, Parameter(group=SAFETY)] = False
    """The valves stay closed; asked.csv has what the controller wants."""
    priority: Annotated[int, whole(0, 99), Parameter(group=SAFETY)] = 0
    """Of SCHED_FIFO, for a process that may have it; 0: none."""
    rig: Annotated[str | None, Parameter(group=SIMULATED, metavar="FILE")] = None
    """TOML file of the simulated rig, else that of --parameters."""
    sensors: Annotated[str, SENSORS, Parameter(group=SIMULATED)] = "lab"
    """Its sensors."""
    lockstep: Annotated[bool, Parameter(group=SIMULATED)] = False
    """It waits for every answer instead of running by the clock."""
    provoke: Annotated[list[str], MANY, Parameter(group=SIMULATED, metavar="KIND@S...")] = field(default_factory=list)
    """What goes wrong with it, as nan-pressure@1.5 or silence@2+0.01."""
    out: Path | None = None
    """Folder for log.csv, asked.csv, timing.json and, by the clock, timing.png."""


def main(settings: Settings) -> None:
    """Drive."""
    drive(settings)
