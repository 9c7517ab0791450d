"""``--to fmu``: the rig for tools that speak FMI, alone or under a law."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from baselines.controller import RESIDUAL
from birthsim.command_line.settings import CONTROL, CONTROLLER, MANY, Configured, Env, RigFile, Seed, Sensors
from birthsim.exports import Form
from birthsim_build.bundle import identifier, scenario_of
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.fmu.archive import BINARIES, VERSIONS, write_fmu
from birthsim_build.fmu.model import fmu_model
from birthsim_build.loops import law_part, scenario_world
from birthsim_env.ids import rig_for
from birthsim_env.physics.rig.reading import named
from birthsim_env.registry import register


@dataclass(kw_only=True)
class Settings(Configured):
    """Write a functional mock-up unit for co-simulation: the plant with its sensors, moved by spool openings and the hand's
    force, or with --controller the closed loop, moved by setpoints and that force. No Python is inside.

    Variables, and what was tried in which tool: docs/fmu.md.
    """

    to: Literal["fmu"]
    """Form of the file."""
    controller: Annotated[str | None, CONTROLLER] = None
    """A compiled controller, else the plant alone."""
    policy: Annotated[str | None, Parameter(group=CONTROL, metavar="DIR")] = None
    """A residual policy instead: a folder that birthsim train wrote, or the name of what is shipped."""
    env: Env = "BirthSIM/Circle-v2"
    sensors: Sensors = "ideal"
    parameters: RigFile = None
    seed: Seed = 0
    """Of the sensors' noise."""
    fmi: Annotated[int, Parameter(choices=tuple(map(str, VERSIONS)))] = 2
    """Version of the standard."""
    target: Annotated[list[str], MANY, Parameter(choices=tuple(BINARIES))] = field(default_factory=lambda: ["x86-64"])
    """Processors, else x86-64, Linux."""
    out: Path
    """File, ending in .fmu."""


def main(settings: Settings) -> None:
    """Write the file and count its variables."""
    if settings.out.suffix != ".fmu":
        raise ValueError(f"--out {named(settings.out)}; allowed: a file that ends in .fmu")
    if settings.controller and settings.policy:
        raise ValueError("--controller with --policy; allowed: one of them")
    scenario_of(settings.env)
    require_llvm()
    require_linker()
    rig = rig_for(settings.env, settings.parameters)
    world = scenario_world(settings.env, settings.sensors, rig, settings.seed)
    name = RESIDUAL if settings.policy else settings.controller
    law = law_part(f"{name}:{settings.policy}" if settings.policy else name, rig, world.sampled) if name else None
    moved = "setpoints" if law else "spool openings"
    about = f"BirthSIM ({name or 'the plant'}, {settings.sensors} sensors), moved by {moved} and the force of a hand"
    model = fmu_model(f"BirthSIM_{identifier(name or 'plant')}", about, world, law, rig)
    write_fmu(model, settings.fmi, settings.out, settings.target)
    kinds = [one.causality for one in model.description.variables]
    counts = ", ".join(f"{kinds.count(kind)} {kind}s" for kind in ("parameter", "input", "output"))
    print(f"written to {settings.out}: {settings.out.stat().st_size:,} bytes, FMI {settings.fmi}, {counts}")


register(export="fmu", about="the rig or a closed loop, for Simulink and its like", order=30)(
    Form(Settings, main, "--out rig.fmu")
)
