"""birthsim export: closed loops without Python, as WebAssembly, for C, or for a microcontroller."""

from __future__ import annotations

import argparse
import platform
from pathlib import Path

from baselines.commands.shared import run, seed_number
from baselines.registry import LISTED, SLOW
from baselines.work.files import make_folder, whole_results, write_json
from birthsim_build.building import Report, build_c, build_cortex, build_wasm
from birthsim_build.bundle import Bundle, make_bundle, scenario_of
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.code.targets import BUILT
from birthsim_build.loops import RESIDUAL
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import load_parameters


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim export",
        description="Compile closed loops, laws alone and the plant alone into code that needs no Python: a WebAssembly module "
        "with JavaScript, a shared library with a C header, or an object for a Cortex-M7 with the laws alone.",
        epilog="Every target computes the same bits as Python. The files are described in docs/build.md.",
    )
    parser.add_argument("--to", choices=("c", *BUILT), required=True, help="the target; c: this processor")
    parser.add_argument("--env", nargs="+", help="environment ids (default: BirthSIM/Circle-v1); not for cortex-m7")
    parser.add_argument("--sensors", nargs="+", choices=tuple(SENSORS), help="default: ideal")
    parser.add_argument("--controller", nargs="+", metavar="NAME", help="compiled controllers (default: backstepping)")
    parser.add_argument(
        "--policy", nargs="+", default=[], help="residual policies besides: folders that birthsim train wrote, or names of "
        "what comes with the package",
    )  # fmt: skip
    parser.add_argument("--all", action="store_true", help="all environments, sensors, compiled controllers and policies")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--seed", type=seed_number, default=0, help="of the episode that begins (default: %(default)s)")
    parser.add_argument("--out", type=Path, required=True, help="folder for the files and build.json")
    run(parser, _build)


def _build(arguments: argparse.Namespace) -> None:
    target = _this_processor() if arguments.to == "c" else arguments.to
    bundle = _bundle(arguments)
    require_llvm()
    if target != "cortex-m7":
        require_linker()
    folder = make_folder(arguments.out)
    with whole_results(folder) as place:
        if target == "wasm":
            report = build_wasm(bundle, place)
        elif target == "cortex-m7":
            report = build_cortex(bundle, place)
        else:
            report = build_c(bundle, target, place)
        write_json(place / "build.json", report)
    _show(report)
    print(f"written to {folder}")


def _bundle(arguments: argparse.Namespace) -> Bundle:
    named = [name for name in ("env", "sensors", "controller", "policy") if getattr(arguments, name)]
    if arguments.all and named:
        raise ValueError(f"--all with --{named[0]}; allowed: one of them")
    alone = arguments.to == "cortex-m7"
    if alone and arguments.env:
        raise ValueError("--env with cortex-m7; allowed: without it, the object has the laws alone")
    rig = load_parameters(arguments.parameters)
    scenarios = list(SCENARIOS) if arguments.all else [scenario_of(one) for one in arguments.env or ["BirthSIM/Circle-v1"]]
    sensors = list(SENSORS) if arguments.all else arguments.sensors or ["ideal"]
    policies = _shipped() if arguments.all else arguments.policy
    controllers = arguments.controller or ([] if policies else ["backstepping"])
    if RESIDUAL in controllers:
        raise ValueError("--controller residual; allowed: --policy NAME")
    if arguments.all:
        controllers = [name for name in LISTED if name not in SLOW]
    return make_bundle(rig, scenarios, sensors, controllers, policies, arguments.seed, alone)


def _this_processor() -> str:
    """The target of this machine."""
    machine = platform.machine().lower()
    if machine not in (names := {"x86_64": "x86-64", "amd64": "x86-64", "aarch64": "aarch64", "arm64": "aarch64"}):
        raise ValueError(f"--to 'c' on the processor {machine!r}; allowed: on {', '.join(names)}")
    return names[machine]


def _shipped() -> list[str]:
    try:
        from agents.policy.seeds import shipped_names
    except ImportError as error:
        raise ValueError(f"{error}; --all needs the extra: pip install 'birthsim[agents]'") from error
    return shipped_names()


def _show(report: Report) -> None:
    for name, value in report.items():
        if name == "estimate":
            for law, found in value.items():
                said = f"{found['operations']:,.0f} operations; at most {found['most']:,.0f} cycles, an estimate"
                print(f"{law:60}{found['cycles']:>12,.0f} cycles a period; {said}")
        elif isinstance(value, dict):
            for key, size in value.items():
                print(f"{name + ' ' + key:60}{size:>12,} bytes")
        elif isinstance(value, int):
            print(f"{name:60}{value:>12,} bytes")
        else:
            print(f"{name:60}{', '.join(value) or 'nothing' if isinstance(value, list) else value:>12}")
