"""Builds every target, compares its bits with Python's, and writes the page of sizes, speeds and bits.

birthsim study targets --out out/targets --page docs/targets.md
"""

from __future__ import annotations

import argparse
import shutil
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

from baselines.commands.shared import run
from baselines.registry import LISTED, SLOW
from baselines.work.files import make_folder, write_json, write_text
from birthsim_build.building import Report, build_c, build_cortex, build_wasm
from birthsim_build.bundle import Bundle, identifier, make_bundle
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.estimate import HOST
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from studies.targets import reference
from studies.targets.page import CLOCK, Line, page
from studies.targets.reference import CHAMBERS, PERIODS, SHARED, as_inputs, first_difference
from studies.targets.running import EMULATED, ROW, emulated_rows, library_loop, library_rows, node_rows

LAWS, POLICY = ("backstepping", "admittance-backstepping"), "circle"
LOOPS = [("ideal", "backstepping"), ("lab", "admittance-backstepping"), ("ideal", f"residual:{POLICY}")]
"""Closed loops on the Circle of which every target gives bits and speed."""

STATE, OPENINGS = slice(ROW["y1"], ROW["y1"] + 18), [ROW[f"opening_{name}"] for name in CHAMBERS]
TIMED = 20_000
"""Control periods of which the speed of a library is taken."""

loop_rows, law_openings, plant_states = cache(reference.loop_rows), cache(reference.law_openings), cache(reference.plant_states)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="birthsim study targets", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--page", type=Path, help="page to write")
    parser.add_argument("--out", type=Path, required=True, help="folder for what is built and targets.json")
    run(parser, _targets)


def _targets(arguments: argparse.Namespace) -> None:
    require_llvm()
    require_linker()
    folder, rig = make_folder(arguments.out), Parameters()
    bundle = make_bundle(rig, ["circle"], ["ideal", "lab"], LAWS, [POLICY])
    every = make_bundle(rig, SCENARIOS, SENSORS, [name for name in LISTED if name not in SLOW], [POLICY])
    results: dict[str, tuple[Report, list[Line]]] = {}
    for target, build, check in (
        ("wasm", build_wasm, _in_node),
        *((target, _library(target), _in_process if target == HOST else _emulated) for target in ("x86-64", "aarch64")),
        ("cortex-m7", build_cortex, _on_cortex),
    ):  # fmt: skip
        place = make_folder(folder / target)
        laws_alone = make_bundle(rig, (), ["ideal", "lab"], LAWS, alone=True)
        report = build(laws_alone if target == "cortex-m7" else bundle, place)
        write_json(place / "build.json", report)
        results[target] = report, check(place, target, report)
        print(*(f"{target:12}{' | '.join(line)}" for line in results[target][1]), sep="\n", flush=True)
    place = make_folder(folder / "every")
    report = build_wasm(every, place)
    wide = list(_wide(place, every))
    print(*(f"{'every':12}{' | '.join(line)}" for line in wide), sep="\n", flush=True)
    write_json(folder / "targets.json", {name: {"report": one, "lines": lines} for name, (one, lines) in results.items()})
    if arguments.page:
        write_text(arguments.page, page(results, report, wide, PERIODS))


def _library(target: str) -> Callable[[Bundle, Path], Report]:
    return lambda bundle, folder: build_c(bundle, target, folder)


def _said(one: Array, other: Array) -> str:
    period = first_difference(one, other)
    return "equal" if period is None else f"differ from period {period} on"


def _per_second(periods: float) -> str:
    return f"{periods:,.0f}/s"


def _in_node(folder: Path, target: str, report: Report) -> list[Line]:
    if shutil.which("node") is None:
        return [("all", "not run: node is missing", "")]
    lines = []
    for sensors, controller in LOOPS:
        choice = {"scenario": "circle", "sensors": sensors, "controller": controller}
        rows, speed = node_rows(folder, ["loop", choice], folder, PERIODS)
        bits = _said(rows[:, SHARED], loop_rows("circle", sensors, controller)[:, SHARED])
        lines.append((f"Circle, {sensors}, {controller}", bits, _per_second(speed)))
    inputs, states = plant_states()
    rows, speed = node_rows(folder, ["plant"], folder, PERIODS, inputs)
    lines.append(("plant alone", _said(rows[:, STATE], states), _per_second(speed)))
    for sensors in ("ideal", "lab"):
        seen, openings = law_openings(LAWS[1], sensors)
        rows, speed = node_rows(folder, ["controller", LAWS[1], sensors], folder, PERIODS, as_inputs(seen))
        lines.append((f"{LAWS[1]} alone, {sensors}", _said(rows[:, OPENINGS], openings), _per_second(speed)))
    return lines


def _in_process(folder: Path, target: str, report: Report) -> list[Line]:
    def speed(name: str) -> str:
        advance, loop = library_loop(folder, name)
        advance(loop.ctypes.data, TIMED)
        started = time.process_time()
        advance(loop.ctypes.data, TIMED)
        return _per_second(TIMED / (time.process_time() - started))

    lines = []
    for sensors, controller in LOOPS:
        name = f"circle_{sensors}_{identifier(controller)}"
        bits = _said(library_rows(folder, name, PERIODS)[:, SHARED], loop_rows("circle", sensors, controller)[:, SHARED])
        lines.append((f"Circle, {sensors}, {controller}", bits, speed(name)))
    inputs, states = plant_states()
    lines.append(("plant alone", _said(library_rows(folder, "plant", PERIODS, inputs)[:, STATE], states), speed("plant")))
    for sensors, kind in (("ideal", "exact"), ("lab", "sampled")):
        (seen, openings), name = law_openings(LAWS[1], sensors), f"law_{identifier(LAWS[1])}_{kind}"
        bits = _said(library_rows(folder, name, PERIODS, as_inputs(seen))[:, OPENINGS], openings)
        lines.append((f"{LAWS[1]} alone, {sensors}", bits, speed(name)))
    return lines


def _emulated(folder: Path, target: str, report: Report) -> list[Line]:
    if shutil.which(EMULATED[target][1]) is None:
        return [("all", f"not run: {EMULATED[target][1]} is missing", "")]
    lines = []
    for sensors, controller in LOOPS:
        rows = emulated_rows(target, folder, f"circle_{sensors}_{identifier(controller)}", PERIODS)
        bits = _said(rows[:, SHARED], loop_rows("circle", sensors, controller)[:, SHARED])
        lines.append((f"Circle, {sensors}, {controller}", bits, "emulated"))
    return lines


def _on_cortex(folder: Path, target: str, report: Report) -> list[Line]:
    lines = []
    for controller in LAWS:
        for sensors, kind in (("ideal", "exact"), ("lab", "sampled")):
            name, bits = f"law_{identifier(controller)}_{kind}", f"not run: {EMULATED[target][1]} is missing"
            if shutil.which(EMULATED[target][1]):
                seen, openings = law_openings(controller, sensors)
                bits = _said(emulated_rows(target, folder, name, PERIODS, seen)[:, OPENINGS], openings)
            found = report["estimate"].get(name)
            cycles = "" if found is None else (
                f"{found['cycles']:,.0f} cycles, at most {found['most']:,.0f} ({1e6 * found['most'] / CLOCK:.0f} us)"
            )  # fmt: skip
            lines.append((f"{controller} alone, {sensors}", bits, cycles))
    return lines


def _wide(folder: Path, bundle: Bundle) -> list[Line]:
    """Every controller on the Circle with sampled positions, and every scenario with all sensors, in Node."""
    if shutil.which("node") is None:
        return [("all", "not run: node is missing", "")]
    names = dict.fromkeys(controller for controller, _ in bundle.laws)
    pairs = [("circle", sensors, controller) for sensors in ("ideal", "lab") for controller in names]
    pairs += [(scenario, sensors, LAWS[1]) for scenario in SCENARIOS for sensors in SENSORS]
    lines = []
    for scenario, sensors, controller in dict.fromkeys(pairs):
        choice = {"scenario": scenario, "sensors": sensors, "controller": controller}
        rows, speed = node_rows(folder, ["loop", choice], folder, PERIODS)
        bits = _said(rows[:, SHARED], loop_rows(scenario, sensors, controller)[:, SHARED])
        lines.append((f"{scenario}, {sensors}, {controller}", bits, _per_second(speed)))
    return lines
