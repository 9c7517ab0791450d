"""birthsim export: the rig for tools that speak FMI, alone or under a law."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.commands.shared import run, seed_number
from birthsim_build.bundle import identifier, scenario_of
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.fmu.archive import BINARIES, VERSIONS, write_fmu
from birthsim_build.fmu.model import fmu_model
from birthsim_build.loops import RESIDUAL, law_part, scenario_world
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import load_parameters


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim export",
        description="Write a functional mock-up unit for co-simulation: the plant with its sensors, moved by spool openings "
        "and the hand's force, or with --controller the closed loop, moved by setpoints and that force. No Python is inside.",
        epilog="Variables, and what was tried in which tool: docs/fmu.md.",
    )
    parser.add_argument("--to", choices=("fmu",), required=True, help="the form of the file")
    parser.add_argument("--controller", metavar="NAME", help="a compiled controller (default: none, the plant)")
    parser.add_argument("--policy", help="a residual policy instead: a folder of birthsim train, or a name that is shipped")
    parser.add_argument("--env", default="BirthSIM/Circle-v1", help="where the end effector begins (default: %(default)s)")
    parser.add_argument("--sensors", choices=tuple(SENSORS), default="ideal", help="default: %(default)s")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--seed", type=seed_number, default=0, help="of the sensors' noise (default: %(default)s)")
    parser.add_argument("--fmi", type=int, choices=VERSIONS, default=2, help="version of the standard (default: %(default)s)")
    parser.add_argument(
        "--target",
        nargs="+",
        metavar="PROCESSOR",
        choices=tuple(BINARIES),
        default=["x86-64"],
        help=f"of {', '.join(BINARIES)} (default: x86-64, Linux)",
    )
    parser.add_argument("--out", type=Path, required=True, help="file, ending in .fmu")
    run(parser, _write)


def _write(arguments: argparse.Namespace) -> None:
    if arguments.out.suffix != ".fmu":
        raise ValueError(f"--out {str(arguments.out)!r}; allowed: a file that ends in .fmu")
    if arguments.controller and arguments.policy:
        raise ValueError("--controller with --policy; allowed: one of them")
    scenario_of(arguments.env)
    require_llvm()
    require_linker()
    rig = load_parameters(arguments.parameters)
    world = scenario_world(arguments.env, arguments.sensors, rig, arguments.seed)
    name = RESIDUAL if arguments.policy else arguments.controller
    law = law_part(name, rig, world.sampled, arguments.policy) if name else None
    moved = "setpoints" if law else "spool openings"
    about = f"BirthSIM ({name or 'the plant'}, {arguments.sensors} sensors), moved by {moved} and the force of a hand"
    model = fmu_model(f"BirthSIM_{identifier(name or 'plant')}", about, world, law, rig)
    write_fmu(model, arguments.fmi, arguments.out, arguments.target)
    kinds = [one.causality for one in model.description.variables]
    counts = ", ".join(f"{kinds.count(kind)} {kind}s" for kind in ("parameter", "input", "output"))
    print(f"written to {arguments.out}: {arguments.out.stat().st_size:,} bytes, FMI {arguments.fmi}, {counts}")
