"""``--to wasm, c, ptx`` and others: closed loops without Python, as WebAssembly, for C, for a microcontroller or for a GPU."""

import platform
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from textwrap import fill
from typing import Annotated

from cyclopts import Parameter

from agents.policy.shipped import loadable_names
from baselines.controller import RESIDUAL
from baselines.named import compiled_names
from baselines.tables import aligned
from birthsim.command_line.settings import CONTROL, CONTROLLER, ENV, MANY, SENSORS, Configured, RigFile, Seed
from birthsim.exports import Form
from birthsim_build.building import Report, build_c, build_cortex, build_threads, build_wasm
from birthsim_build.bundle import make_bundle, scenario_of
from birthsim_build.code.blocks import WIDTH
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.code.ptx import require_assembler
from birthsim_build.code.targets import TARGETS
from birthsim_env.extras import installation
from birthsim_env.files import make_folder, whole_results, write_json
from birthsim_env.ids import rig_for
from birthsim_env.parts.scenarios import environment_id, scenarios_for
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names, register

OLDEST = TARGETS["ptx"].processor
"""The GPU that PTX is for, and all after it."""

FORMS = {
    "wasm": ("closed loops, as WebAssembly with JavaScript", ""),
    "c": ("closed loops, as a library for this processor", ""),
    "x86-64": ("closed loops, as a library with a C header", ""),
    "aarch64": ("closed loops, as a library with a C header", ""),
    "cortex-m7": ("controllers alone, as an object for a microcontroller", ""),
    "ptx": ("closed loops, as kernels for NVIDIA's GPUs", ""),
    "cubin": ("the same for one kind of GPU, by NVIDIA's ptxas", "--gpu sm_90 "),
}
"""Form -> what it is, and what its example names besides the folder."""


@dataclass(kw_only=True)
class Settings(Configured):
    """Compile closed loops, controllers alone and the plant alone into code that needs no Python: a WebAssembly module with
    JavaScript, a shared library with a C header, an object for a Cortex-M7 with the controllers alone, or kernels for an NVIDIA
    GPU, one thread a lane.

    Every target computes the same bits as Python. The files are described in docs/build.md.
    """

    to: Annotated[str, Parameter(choices=tuple(FORMS))]
    """Target; c: this processor."""
    env: Annotated[list[str], MANY, ENV, Parameter(metavar="ID...")] = field(default_factory=list)
    """Environments, else BirthSIM/Circle-v2; not for cortex-m7."""
    sensors: Annotated[list[str], MANY, SENSORS] = field(default_factory=list)
    """Sensor models, else ideal."""
    controller: Annotated[list[str], MANY, CONTROLLER, Parameter(metavar="NAME...")] = field(default_factory=list)
    """Compiled controllers, else backstepping."""
    policy: Annotated[list[str], MANY, Parameter(group=CONTROL, metavar="DIR...")] = field(default_factory=list)
    """Residual policies besides: folders that birthsim train wrote, or names of what is shipped."""
    all: bool = False
    """All environments, sensors, compiled controllers and policies."""
    gpu: str | None = None
    """Architecture of a cubin, as sm_90; else sm_80. PTX runs on any from there on."""
    parameters: RigFile = None
    seed: Seed | None = None
    """Of the episode that begins, else 0; kernels are told it where they run."""
    out: Path
    """Folder for the files and build.json."""


def main(settings: Settings) -> None:
    """Build what is asked for, and say how large it is."""
    target = _this_processor() if settings.to == "c" else settings.to
    threads = target in ("ptx", "cubin")
    if settings.gpu and target != "cubin":
        raise ValueError(f"--gpu with {target}; allowed: with cubin")
    if threads and settings.seed is not None:
        raise ValueError(f"--seed with {target}; allowed: with other targets, kernels are told it where they run")
    rig = rig_for((settings.env or [""])[0], settings.parameters)
    scenarios, sensors, controllers, policies = _chosen(settings, rig)
    require_llvm()
    if target == "cubin":
        require_assembler()
    elif not threads and target != "cortex-m7":
        require_linker()
    bundle = None
    if not threads:  # which compiles: what it needs is looked for before
        bundle = make_bundle(rig, scenarios, sensors, controllers, policies, settings.seed or 0, target == "cortex-m7")
    folder = make_folder(settings.out)
    with whole_results(folder) as place:
        if bundle is None:
            laws = [*controllers, *(f"{RESIDUAL}:{name}" for name in policies)]
            gpu = (settings.gpu or OLDEST) if target == "cubin" else None
            report = build_threads(list(product(scenarios, sensors, laws)), rig, gpu, place)
        elif target == "wasm":
            report = build_wasm(bundle, place)
        elif target == "cortex-m7":
            report = build_cortex(bundle, place)
        else:
            report = build_c(bundle, target, place)
        write_json(place / "build.json", report)
    _show(report)
    print(f"written to {folder}")


for _order, (_form, (_about, _besides)) in enumerate(FORMS.items(), 20):
    register(export=_form, about=_about, order=_order)(Form(Settings, main, f"{_besides}--out out/{_form}"))


def _chosen(settings: Settings, rig: Parameters) -> tuple[list[str], list[str], list[str], list[str]]:
    """Scenarios, sensors, controllers and policies."""
    named = [name for name in ("env", "sensors", "controller", "policy") if getattr(settings, name)]
    if settings.all and named:
        raise ValueError(f"--all with --{named[0]}; allowed: one of them")
    if settings.to == "cortex-m7" and settings.env:
        raise ValueError("--env with cortex-m7; allowed: without it, the object has the controllers alone")
    if RESIDUAL in settings.controller:
        raise ValueError("--controller residual; allowed: --policy NAME")
    if settings.all:
        return scenarios_for(rig), names("sensors"), compiled_names(listed=True), _shipped()
    scenarios = [scenario_of(one) for one in settings.env or [environment_id(scenarios_for(rig)[0])]]
    controllers = settings.controller or ([] if settings.policy else ["backstepping"])
    return scenarios, list(settings.sensors or ["ideal"]), controllers, settings.policy


def _this_processor() -> str:
    """The target of this machine."""
    machine = platform.machine().lower()
    if machine not in (names := {"x86_64": "x86-64", "amd64": "x86-64", "aarch64": "aarch64", "arm64": "aarch64"}):
        raise ValueError(f"--to 'c' on the processor {machine!r}; allowed: on {', '.join(names)}")
    return names[machine]


def _shipped() -> list[str]:
    found = loadable_names()
    if not found:
        raise ValueError(f"--all needs the extra: {installation('agents')}")
    return found


def _show(report: Report) -> None:
    sizes: list[tuple[str, str]] = []
    for name, value in report.items():
        if name in ("estimate", "thread"):
            continue
        if isinstance(value, dict):
            sizes += [(f"{name} {key}", f"{size:,}") for key, size in value.items()]
        elif isinstance(value, int):
            sizes.append((name, f"{value:,}"))
        else:
            said = ", ".join(value) or "nothing" if isinstance(value, list) else value
            print(fill(f"{name}: {said}", 80, subsequent_indent="    "))
    print(aligned(("", "bytes"), sizes))
    if thread := report.get("thread"):
        memory, spilled, registers, shared = (thread[one] for one in ("memory", "spilled", "registers", "shared"))
        print(f"a thread takes {registers} registers and {memory:,} bytes of memory; {spilled:,} bytes are spilled registers")
        print(f"a block of {WIDTH} threads shares {shared:,} bytes")
    if laws := report.get("estimate"):
        counts = [(law, *(f"{found[one]:,.0f}" for one in ("operations", "cycles", "most"))) for law, found in laws.items()]
        print(f"\n{aligned(('a period, estimated', 'operations', 'cycles', 'at most'), counts)}")
