"""``birthsim run``: one episode of one controller, its error over time printed, its motion drawn."""

from dataclasses import dataclass, field
from pathlib import Path

from birthsim.command_line.settings import Controller, Env, Parts, Randomize, RigFile, Seed, Sensors, Set, Style


@dataclass(kw_only=True)
class Settings(Parts):
    """Run one episode, print its error second by second, and draw its motion."""

    env: Env = "BirthSIM/Circle-v2"
    controller: Controller = "admittance"
    set: Set = field(default_factory=list)
    seed: Seed = 0
    """Seed of the episode."""
    sensors: Sensors = "ideal"
    randomize: Randomize = "none"
    """What the seed draws at random."""
    parameters: RigFile = None
    style: Style = "screen"
    out: Path
    """Folder for the figure of the episode."""


def main(settings: Settings) -> None:
    """Load what an episode takes, seconds, and run it."""
    from birthsim.episode import run

    run(settings)
