"""birthsim train: policies by reinforcement learning or gradients, several seeds at once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from birthsim.command_line.settings import (
    ALGORITHM,
    PROCESSES,
    RANDOMIZE,
    Env,
    Friction,
    Randomize,
    RigFile,
    Seed,
    Sensors,
    whole,
)

CHANGES = ("algorithm", "steps", "sensors", "friction", "until", "law", "impedance", "authority")
"""Options that are called as the settings of a training that they change."""


@dataclass(kw_only=True)
class Settings:
    """Train residual policies on top of a controller, by reinforcement learning or by gradients through the loop.

    Options override what the configuration says, and have its values by default. The best policy on validation worlds is kept
    whenever it improves, and a checkpoint every half minute and on Ctrl-C: the same command then goes on, and ends with the
    same policy, checkpoint and events. After a kill it does so from the last checkpoint.
    """

    config: Annotated[str, Parameter(metavar="NAME")] = "circle"
    """A configuration of agents/configurations, such as circle_quick, rig_reader for a network that reads rigs, or a file."""
    algorithm: Annotated[str | None, ALGORITHM] = None
    """How it learns, one of the algorithms listed below; it sets the hyperparameters that the configuration leaves out."""
    law: Annotated[str | None, Parameter(metavar="NAME")] = None
    """Controller to be corrected, such as backstepping-force-first; none: the policy drives the valves alone."""
    impedance: Literal["fixed", "variable_kp", "variable"] | None = None
    """What an action changes besides forces."""
    authority: Annotated[float | None, Parameter(metavar="N")] = None
    """Bound of the residual force."""
    steps: Annotated[int | None, whole()] = None
    """Policy steps of each seed."""
    until: Annotated[float | None, Parameter(metavar="PERCENT")] = None
    """Stop once the validation error is this far below that of the paper's controller."""
    seed: Seed | None = None
    """First seed. [default: that of the configuration, 0]"""
    seeds: Annotated[int, whole()] = 1
    """Number of consecutive seeds, from --seed on."""
    jobs: Annotated[int, whole(), Parameter(group=PROCESSES)] = 1
    """Number of seeds trained in parallel."""
    out: Path
    """Folder; each seed gets one in it with its policy, checkpoint, curve and events."""
    env: Env | None = None
    sensors: Sensors | None = None
    randomize: Randomize | None = None
    """What training varies."""
    friction: Friction | None = None
    parameters: RigFile = None


def main(settings: Settings) -> None:
    """Train every seed and report; what that needs takes seconds to load."""
    from agents.reader.settings import is_reader
    from birthsim.command_line.worlds import check_environment
    from birthsim.training import carry_out, plan, report, require_extra, worlds_of
    from birthsim_env.parts.drawn.randomization import described

    if settings.env is not None:
        check_environment(settings.env, residual=True)
    said = {
        "environment": settings.env,
        "randomize": None if settings.randomize is None else RANDOMIZE[settings.randomize],
        **{name: getattr(settings, name) for name in CHANGES},
    }
    changes = {name: value for name, value in said.items() if value is not None}
    if is_reader(settings.config):
        require_extra()
        _read(settings, changes)
        return
    own = plan(settings.config, settings.out, settings.seed, settings.seeds, settings.jobs, settings.parameters, changes)
    print(described(own.rig, own.training.randomize, own.training.sensors))
    print(worlds_of(own))
    report(own, carry_out(own))
    print(f"written to {settings.out}/")


def _read(settings: Settings, changes: dict[str, Any]) -> None:
    """Teach networks that read a rig."""
    from birthsim import reading

    if "friction" in changes:
        changes["frictions"] = (changes.pop("friction"),)
    own = reading.plan(
        settings.config, settings.out, settings.seed, settings.seeds, settings.jobs, settings.parameters, changes
    )
    reading.report(own, reading.carry_out(own))
    print(f"written to {settings.out}/")
