"""The page of sizes, speeds and bits."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence

from birthsim_build.building import Report
from birthsim_build.estimate import CYCLES

Line = tuple[str, str, str]
"""What, its bits, and its speed or estimate."""

CLOCK = 400e6
"""Hz, of a Cortex-M7 whose microseconds are told; assumed, usual are 216 to 600 MHz."""

BREAKS = """## What breaks the bits where

| operation | where its bits could differ | here |
| --- | --- | --- |
| + - * / and square root, double precision | nowhere (IEEE 754) | used |
| comparison, floor, absolute value, sign, conversion | nowhere | used |
| a product and a sum fused | aarch64, Cortex-M7, x86-64 with FMA | not allowed; none occurs |
| exp, log, sin, cos, tanh of a library | every platform | not called; the package has its own |
| sums in another order (vectors) | every platform | not allowed without fast mathematics |
| sign and payload of a NaN | WebAssembly | a rig whose state is a NaN is lost before that matters |"""


def _table(head: tuple[str, ...], lines: Sequence[tuple[str, ...]]) -> str:
    rows = [head, tuple("---" for _ in head), *lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def page(results: Mapping[str, tuple[Report, list[Line]]], every: Report, wide: list[Line], periods: int) -> str:
    """The page of what targets take and compute, ``results``, and of a build of ``every`` loop with its lines ``wide``."""
    sizes = [(target, *_sizes(report)) for target, (report, _) in results.items()]
    equal = sum(line[1] == "equal" for line in wide)
    parts = [
        "# Sizes, speeds and bits of what is built",
        "[Without Python](build.md) says how to compile the closed loop for other machines. This page shows what comes out. "
        "`birthsim study targets --out out/targets --page docs/targets.md` wrote it, for the Circle, "
        "ideal and lab sensors and three laws.",
        f"- **Bits.** {periods} control periods (200 policy steps) are compared with Python. They are equal if all bits are: "
        "of the plant's state, of what the sensors say, of what is asked for and of the openings.\n"
        "- **Speeds** are control periods per second of CPU time, of one core "
        f"({platform.machine()}) that others used too. A policy step has 10 periods.",
        _table(("target", "code and data", "needs from elsewhere"), sizes),
        *(
            f"## {target}\n\n{_table(('what', 'bits', 'speed' if target != 'cortex-m7' else 'estimate per period'), lines)}"
            for target, (_, lines) in results.items()
        ),
        _firmware(results["cortex-m7"][0]),
        BREAKS,
        "## All loops",
        "`birthsim export --to wasm` with all scenarios, sensors and compiled controllers and one policy takes "
        f"{sum(every['bytes'].values()) / 1e3:,.0f} kB. {len(wide)} loops ran in Node: every controller on the Circle, and "
        f"every scenario with every sensor model. {equal} of them have the bits of Python.",
        _table(("loop", "bits", "speed"), wide),
    ]
    return "\n\n".join(parts) + "\n"


def _firmware(report: Report) -> str:
    alone = "\n".join(f"- `{name}`: {size:,}" for name, size in report["loops"].items())
    cycles = ", ".join(f"{cycles} for {kind}" for kind, cycles in CYCLES.items())
    return (
        f"The deepest stack is {report['stack']} bytes. This is the sum of the frames along the longest chain of calls in the "
        "assembly, without those of the library functions that are needed. A running law takes these bytes of RAM:\n\n"
        f"{alone}\n\n"
        "The cycles are an estimate. The operations that the optimised code executes were counted on this machine. Each "
        f"was multiplied with an assumed number of cycles: {cycles}. Microseconds are at {CLOCK / 1e6:.0f} MHz. The bits are "
        "those under qemu. No board has run it."
    )


def _sizes(report: Report) -> tuple[str, str]:
    if "bytes" in report:
        return ", ".join(f"`{name}` {size / 1e3:,.0f} kB" for name, size in report["bytes"].items()), "nothing"
    kilobytes = f"code {report['text'] / 1e3:,.0f} kB, constants and loops {report['rodata'] / 1e3:,.0f} kB"
    return f"{kilobytes}, bss {report['bss']} bytes", ", ".join(f"`{name}`" for name in report["needs"]) or "nothing"
