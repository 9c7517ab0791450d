"""birthsim evaluate: controllers and policies over seeded episodes, with tables, JSON and figures."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from birthsim.command_line.settings import (
    CONTROL,
    EPISODES,
    Controllers,
    Env,
    Parts,
    Processes,
    Randomize,
    RigFile,
    Sensors,
    Set,
    Style,
    WorldSeed,
    whole,
)


@dataclass(kw_only=True)
class Settings(Parts, Processes):
    """Evaluate controllers, each on the same seeds and therefore in the same worlds.

    Without --controller and --policy the controller is backstepping. With --policy the trained residual is evaluated together
    with the named controllers, or else with the paper's and the one that it corrects. Results that the output folder has of the
    same settings, rig and code are kept, so that an interrupted run continues.
    """

    env: Env = "BirthSIM/Circle-v2"
    controller: Controllers = None
    policy: Annotated[str | None, Parameter(group=CONTROL, metavar="DIR")] = None
    """For the controller residual: a folder that birthsim train wrote, or the name of a shipped policy, such as circle."""
    set: Set = field(default_factory=list)
    episodes: Annotated[int, whole(1, EPISODES)] = 32
    """Episodes of each controller."""
    seed: WorldSeed = 0
    """Seed of the first episode, or a split, whose first seed it is: train, validation, scale, test. Report results of test."""
    sensors: Sensors = "ideal"
    randomize: Randomize = "all"
    """What differs between episodes; sensors means the scenario, and the parameters of honest sensors."""
    parameters: RigFile = None
    style: Style = "screen"
    out: Path
    """Folder for evaluation.json, .md and .csv, and figures."""


def main(settings: Settings) -> None:
    """Run the episodes that the folder lacks; what that needs takes seconds to load."""
    from birthsim.evaluation import run

    run(settings)
