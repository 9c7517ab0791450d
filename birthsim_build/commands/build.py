"""birthsim export: closed loops without Python, as WebAssembly, for C, or for a microcontroller."""

import platform
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import fill
from typing import Annotated

from cyclopts import Parameter

from baselines.about import RESIDUAL
from baselines.commands.settings import CONTROL, CONTROLLER, MANY, WORLD, Configured, Kind, RigFile, Seed
from baselines.commands.tables import aligned
from baselines.registry import LISTED
from birthsim_build.building import Report, build_c, build_cortex, build_wasm
from birthsim_build.bundle import Bundle, make_bundle, scenario_of
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.code.targets import BUILT
from birthsim_env.files import make_folder, whole_results, write_json
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import load_parameters


@dataclass(kw_only=True)
class Settings(Configured):
    """Compile closed loops, controllers alone and the plant alone into code that needs no Python: a WebAssembly module with
    JavaScript, a shared library with a C header, or an object for a Cortex-M7 with the controllers alone.

    Every target computes the same bits as Python. The files are described in docs/build.md.
    """

    to: Annotated[str, Parameter(choices=("c", *BUILT))]
    """Target; c: this processor."""
    env: Annotated[list[str], MANY, Parameter(group=WORLD, metavar="ID...")] = field(default_factory=list)
    """Environments, else BirthSIM/Circle-v1; not for cortex-m7."""
    sensors: Annotated[list[Kind], MANY, Parameter(group=WORLD)] = field(default_factory=list)
    """Sensor models, else ideal."""
    controller: Annotated[list[str], MANY, CONTROLLER, Parameter(metavar="NAME...")] = field(default_factory=list)
    """Compiled controllers, else backstepping."""
    policy: Annotated[list[str], MANY, Parameter(group=CONTROL, metavar="DIR...")] = field(default_factory=list)
    """Residual policies besides: folders that birthsim train wrote, or names of what is shipped."""
    all: bool = False
    """All environments, sensors, compiled controllers and policies."""
    parameters: RigFile = None
    seed: Seed = 0
    """Of the episode that begins."""
    out: Path
    """Folder for the files and build.json."""


def main(settings: Settings) -> None:
    """Build what is asked for, and say how large it is."""
    target = _this_processor() if settings.to == "c" else settings.to
    bundle = _bundle(settings)
    require_llvm()
    if target != "cortex-m7":
        require_linker()
    folder = make_folder(settings.out)
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


def _bundle(settings: Settings) -> Bundle:
    named = [name for name in ("env", "sensors", "controller", "policy") if getattr(settings, name)]
    if settings.all and named:
        raise ValueError(f"--all with --{named[0]}; allowed: one of them")
    alone = settings.to == "cortex-m7"
    if alone and settings.env:
        raise ValueError("--env with cortex-m7; allowed: without it, the object has the laws alone")
    rig = load_parameters(settings.parameters)
    scenarios = list(SCENARIOS) if settings.all else [scenario_of(one) for one in settings.env or ["BirthSIM/Circle-v1"]]
    sensors = list(SENSORS) if settings.all else settings.sensors or ["ideal"]
    policies = _shipped() if settings.all else settings.policy
    controllers = settings.controller or ([] if policies else ["backstepping"])
    if RESIDUAL in controllers:
        raise ValueError("--controller residual; allowed: --policy NAME")
    if settings.all:
        controllers = list(LISTED)
    return make_bundle(rig, scenarios, sensors, controllers, policies, settings.seed, alone)


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
    sizes: list[tuple[str, str]] = []
    for name, value in report.items():
        if name == "estimate":
            continue
        if isinstance(value, dict):
            sizes += [(f"{name} {key}", f"{size:,}") for key, size in value.items()]
        elif isinstance(value, int):
            sizes.append((name, f"{value:,}"))
        else:
            said = ", ".join(value) or "nothing" if isinstance(value, list) else value
            print(fill(f"{name}: {said}", 80, subsequent_indent="    "))
    print(aligned(("", "bytes"), sizes))
    if laws := report.get("estimate"):
        counts = [(law, *(f"{found[one]:,.0f}" for one in ("operations", "cycles", "most"))) for law, found in laws.items()]
        print(f"\n{aligned(('a period, estimated', 'operations', 'cycles', 'at most'), counts)}")
