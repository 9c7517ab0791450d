"""Every target is built, its bits are compared with Python's, and its size and speed are taken."""

import shutil
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baselines.named import compiled_names
from baselines.work.tasks import Result, Task
from birthsim_build.building import build_c, build_cortex, build_threads, build_wasm
from birthsim_build.bundle import Bundle, identifier, loop_name, make_bundle
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.code.targets import HOST
from birthsim_build.estimate import CYCLES
from birthsim_env import registry
from birthsim_env.files import write_json
from birthsim_env.parts.scenarios import studied_scenarios
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Options, Study, as_found
from lab.engine.tables import markdown
from lab.studies.targets.reference import (
    CHAMBERS,
    PERIODS,
    SHARED,
    as_inputs,
    first_difference,
    law_openings,
    loop_rows,
    plant_states,
)
from lab.studies.targets.running import EMULATED, ROW, emulated_rows, library_loop, library_rows, node_rows, thread_rows

LAWS, POLICY = ("backstepping", "admittance-backstepping"), "circle"
LOOPS = (("ideal", "backstepping"), ("lab", "admittance-backstepping"), ("ideal", f"residual:{POLICY}"))
"""Closed loops on the Circle of which every target gives bits and speed."""

TARGETS = ("wasm", "x86-64", "aarch64", "cortex-m7", "ptx", "every")
"""What is built; ``every``: WebAssembly with all scenarios, sensors and compiled controllers."""

STATE, OPENINGS = slice(ROW["y1"], ROW["y1"] + 18), [ROW[f"opening_{name}"] for name in CHAMBERS]
TIMED = 20_000
"""Control periods of which the speed of a library is taken."""

CLOCK = 400e6
"""Hz, of a Cortex-M7 whose microseconds are told; assumed, usual are 216 to 600 MHz."""


@dataclass(frozen=True)
class Case:
    """What runs: its label, what Node makes, the loop's name in a library, the rows that are compared, and what makes Python's
    with the inputs of each period."""

    label: str
    node: list[Any]
    name: str
    rows: Any
    python: Callable[[], tuple[Any, Array]]


def _loop(scenario: str, sensors: str, controller: str) -> Case:
    choice = {"scenario": scenario, "sensors": sensors, "controller": controller}
    name = loop_name(scenario, sensors, controller)
    python = lambda: (None, loop_rows(scenario, sensors, controller)[:, SHARED])  # noqa: E731
    return Case(f"{scenario}, {sensors}, {controller}", ["loop", choice], name, SHARED, python)


def _law(controller: str, sensors: str) -> Case:
    name = f"law_{identifier(controller)}_{'exact' if sensors == 'ideal' else 'sampled'}"
    make = ["controller", controller, sensors]
    return Case(f"{controller} alone, {sensors}", make, name, OPENINGS, lambda: law_openings(controller, sensors))


def _cases(target: str, bundle: Bundle) -> list[Case]:
    if target == "every":
        names = dict.fromkeys(controller for controller, _ in bundle.laws)
        loops = [("circle", sensors, controller) for sensors in ("ideal", "lab") for controller in names]
        loops += [(scenario, sensors, LAWS[1]) for scenario in studied_scenarios() for sensors in registry.names("sensors")]
        return [_loop(*loop) for loop in dict.fromkeys(loops)]
    if target == "cortex-m7":
        return [_law(controller, sensors) for controller in LAWS for sensors in ("ideal", "lab")]
    cases = [_loop("circle", *loop) for loop in LOOPS]
    rest = [Case("plant alone", ["plant"], "plant", STATE, plant_states), _law(LAWS[1], "ideal"), _law(LAWS[1], "lab")]
    return cases if target in EMULATED else [*cases, *rest]


def built(target: str) -> Result:
    """What the build says of sizes, and per case its bits ("equal" or from where they differ) and its speed, periods/s."""
    require_llvm()
    rig = Parameters()
    if target == "ptx":
        return _threads(rig)
    require_linker()
    if target == "every":
        bundle = make_bundle(rig, studied_scenarios(), registry.names("sensors"), compiled_names(listed=True), [POLICY])
    elif target == "cortex-m7":
        bundle = make_bundle(rig, (), ["ideal", "lab"], LAWS, alone=True)
    else:
        bundle = make_bundle(rig, ["circle"], ["ideal", "lab"], LAWS, [POLICY])
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if target in ("wasm", "every"):
            report, program = build_wasm(bundle, folder), "node"
        else:
            report = build_cortex(bundle, folder) if target == "cortex-m7" else build_c(bundle, target, folder)
            program = "" if target == HOST else EMULATED[target][1]
        write_json(folder / "build.json", report)
        if program and shutil.which(program) is None:
            return {"report": report, "lines": [["all", f"not run: {program} is missing", None]]}
        return {"report": report, "lines": [_line(target, folder, case) for case in _cases(target, bundle)]}


def _threads(rig: Parameters) -> Result:
    """What a graphics processor gets, with the bits of what its threads run, run here."""
    loops = [("circle", *loop) for loop in LOOPS]
    with tempfile.TemporaryDirectory() as place:
        folder, lines = Path(place), list[Any]()
        build_threads(loops, rig, None, folder)
        sizes = {path.name: path.stat().st_size for path in sorted(folder.iterdir()) if path.suffix in (".ptx", ".bin")}
        for rows, case in zip(thread_rows(loops, rig, folder, PERIODS), (_loop(*loop) for loop in loops), strict=True):
            period = first_difference(rows[:, case.rows], case.python()[1])
            lines.append([case.label, _verdict(period), None])
    return {"report": {"bytes": sizes}, "lines": lines}


def _verdict(period: int | None) -> str:
    """The bits, in words."""
    return "equal" if period is None else f"differ from period {period} on"


def _line(target: str, folder: Path, case: Case) -> list[Any]:
    given, wanted = case.python()
    inputs, speed = as_inputs(given) if case.rows is OPENINGS else given, None
    if target in EMULATED:
        rows = emulated_rows(target, folder, case.name, PERIODS, given)
    elif target == HOST:
        rows, speed = library_rows(folder, case.name, PERIODS, inputs), _library_speed(folder, case.name)
    else:
        rows, speed = node_rows(folder, case.node, folder, PERIODS, inputs)
    period = first_difference(rows[:, case.rows], wanted)
    return [case.label, _verdict(period), speed]


def _library_speed(folder: Path, name: str) -> float:
    """Control periods per second of CPU time, after as many that warm up."""
    advance, loop = library_loop(folder, name)
    advance(loop.ctypes.data, TIMED)
    started = time.process_time()
    advance(loop.ctypes.data, TIMED)
    return TIMED / (time.process_time() - started)


def _shown(content: Content) -> dict[str, str]:
    figures = content["figures"]
    sizes = [_sizes(name, found["report"]) for name, found in figures.items()]
    parts = [
        f"{PERIODS} control periods (200 policy steps). Speeds are control periods per second of CPU time of one core, "
        f"{content['processor']}.",
        markdown([["target", "code and data", "needs from elsewhere"], *sizes]),
    ]
    for target, found in figures.items():
        laws = found["report"].get("estimate") or {}
        rows = [["what", "bits compared with Python", "estimate per period" if laws else "speed"]]
        untimed = "a thread's code, run here" if target == "ptx" else "emulated"
        rows += [
            [label, bits, _cycles(laws, label) if laws else untimed if speed is None else f"{speed:,.0f}/s"]
            for label, bits, speed in found["lines"]
        ]
        parts += [f"### {target}", markdown(rows), *([_firmware(found["report"])] if laws else [])]
    return {"targets.md": "\n\n".join(parts) + "\n"}


def _sizes(target: str, report: dict[str, Any]) -> list[str]:
    if "bytes" in report:
        return [target, ", ".join(f"`{name}` {size / 1e3:,.0f} kB" for name, size in report["bytes"].items()), "nothing"]
    kilobytes = f"code {report['text'] / 1e3:,.0f} kB, constants and loops {report['rodata'] / 1e3:,.0f} kB"
    return [target, f"{kilobytes}, bss {report['bss']} bytes", ", ".join(f"`{name}`" for name in report["needs"]) or "nothing"]


def _cycles(laws: dict[str, Any], label: str) -> str:
    controller, _, sensors = label.partition(" alone, ")
    found = laws.get(_law(controller, sensors).name)
    return (
        ""
        if found is None
        else (f"{found['cycles']:,.0f} cycles, at most {found['most']:,.0f} ({1e6 * found['most'] / CLOCK:.0f} us)")
    )


def _firmware(report: dict[str, Any]) -> str:
    rows = [["a running controller", "bytes of RAM"], *([f"`{name}`", f"{size:,}"] for name, size in report["loops"].items())]
    cycles = [["operation", *CYCLES], ["assumed cycles", *map(str, CYCLES.values())]]
    said = f"The deepest stack is {report['stack']} bytes. Microseconds are at {CLOCK / 1e6:.0f} MHz."
    return "\n\n".join([said, markdown(rows), markdown(cycles)])


def _tasks(options: Options) -> dict[Any, Task]:
    return {name: Task(name, built, {"target": name}) for name in dict.fromkeys(options.target)}


STUDY = Study(
    {"target": TARGETS},
    _tasks,
    as_found,
    {"speed": "control periods/s", "cycles": "1", "bytes": "B"},
    _shown,
    timed=True,
    allowed={"target": TARGETS},
    words={"target": "what is built; every: all loops as WebAssembly"},
)
register(study="targets", about="built code of every target, against Python")(STUDY)
