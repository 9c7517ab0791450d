"""``--to fmu``: for tools that speak FMI, the rig, the closed loop or the controller alone."""

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
from birthsim_build.fmu.units import controller_unit, loop_unit, plant_unit
from birthsim_build.loops import PAIRED_VALVES, law_part, scenario_world
from birthsim_env.ids import rig_for
from birthsim_env.physics.rig.reading import named
from birthsim_env.registry import register


@dataclass(kw_only=True)
class Settings(Configured):
    """Write a functional mock-up unit for co-simulation: the plant with its sensors, moved by spool openings and the hand's
    force; with --controller the closed loop, moved by setpoints and that force; or with --alone that controller without the
    rig, from measured signals and setpoints to spool openings. No Python is inside.

    Variables, and what was tried in which tool: docs/fmu.md.
    """

    to: Literal["fmu"]
    """Form of the file."""
    controller: Annotated[str | None, CONTROLLER] = None
    """A compiled controller, else the plant alone."""
    policy: Annotated[str | None, Parameter(group=CONTROL, metavar="DIR")] = None
    """A residual policy instead: a folder that birthsim train wrote, or the name of what is shipped."""
    alone: bool = False
    """The controller without the rig, for a rig of yours or a unit of the plant: what it measures comes in, openings go out."""
    valves: Annotated[Literal["two_valves", "one_valve"], Parameter(group=CONTROL)] = "two_valves"
    """What the controller moves: a valve per chamber, or a 5/3 valve per cylinder."""
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
    name = RESIDUAL if settings.policy else settings.controller
    for option, given in (("--alone", settings.alone), ("--valves", settings.valves == "one_valve")):
        if given and not name:
            raise ValueError(f"{option} without a controller; allowed: with --controller or --policy")
    scenario_of(settings.env)
    require_llvm()
    require_linker()
    rig = rig_for(settings.env, settings.parameters)
    world = scenario_world(settings.env, settings.sensors, rig, settings.seed)
    identified, moved = f"BirthSIM_{identifier(name or 'plant')}", "setpoints and the force of a hand"
    if name is None:
        unit, moved = plant_unit(world, rig), "spool openings and the force of a hand"
    else:
        laws = {"law": law_part(f"{name}:{settings.policy}" if settings.policy else name, rig, world.sampled)}
        laws |= {"valves": PAIRED_VALVES} if settings.valves == "one_valve" else {}
        if settings.alone:
            unit, moved, identified = controller_unit(world, laws, rig), "signals and setpoints", f"{identified}_alone"
        else:
            unit = loop_unit(world, laws, rig)
    about = f"BirthSIM ({name or 'the plant'}{', alone' * settings.alone}, {settings.sensors} sensors), moved by {moved}"
    model = fmu_model(identified, about, world.rows, unit, rig)
    write_fmu(model, settings.fmi, settings.out, settings.target)
    kinds = [one.causality for one in model.description.variables]
    counts = ", ".join(f"{kinds.count(kind)} {kind}s" for kind in ("parameter", "input", "output"))
    print(f"written to {settings.out}: {settings.out.stat().st_size:,} bytes, FMI {settings.fmi}, {counts}")


register(export="fmu", about="the rig, a closed loop or a controller alone, for Simulink", order=30)(
    Form(Settings, main, "--out rig.fmu")
)
