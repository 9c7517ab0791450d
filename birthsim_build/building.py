"""Builds a bundle for a target into a folder."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from birthsim_build.bundle import LAW, Bundle
from birthsim_build.code.compiler import EMULATIONS, compile_object, link
from birthsim_build.code.elf import sections_of, undefined_in
from birthsim_build.code.ptx import assemble
from birthsim_build.code.stack import stack_bytes
from birthsim_build.code.threads import Threads
from birthsim_build.device.export import write_programs
from birthsim_build.estimate import estimates
from birthsim_build.faces.beliefs import beliefs
from birthsim_build.faces.c import write_examples, write_header, write_kernels
from birthsim_build.faces.javascript import write_javascript
from birthsim_build.image import Words
from birthsim_env.files import temporary_folder
from birthsim_env.physics.rig.parameters import Parameters

STACK = 65536
"""Bytes of stack in WebAssembly; the largest loop takes a tenth."""

Report = dict[str, Any]

Loop = tuple[str, str, str]
"""Scenario, sensors and controller."""


def write_wasm(functions: list[str], out: Path, threads: Threads | None = None) -> None:
    """Write the code of stages and of what runs an image of them, or ``threads`` a program."""
    with temporary_folder() as place:
        built = place / "birthsim.o"
        compile_object(functions, "wasm", built, threads=threads)
        runs = threads.runs if threads else ("advance",)
        exported = ("--export=__heap_base", *(f"--export=birthsim_{name}" for name in runs))
        options = ("--no-entry", "--stack-first", "-z", f"stack-size={STACK}", "--strip-all", *exported)
        link("wasm-ld", *options, "-o", str(out), str(built))


def build_wasm(bundle: Bundle, folder: Path) -> Report:
    """Write code, data and the JavaScript module; returns their sizes in bytes."""
    write_wasm(bundle.functions, folder / "birthsim.wasm")
    write_javascript(bundle, folder)
    names = ("birthsim.wasm", "birthsim.bin", "birthsim.js", "layout.js")
    return {"target": "wasm", "bytes": {name: (folder / name).stat().st_size for name in names}}


def build_c(bundle: Bundle, target: str, folder: Path) -> Report:
    """Write a shared library for Linux, the object that it is made of, the header and examples; returns sizes in bytes."""
    images = bundle.images()
    built = _object(bundle, target, folder, images)
    link(
        "ld.lld",
        "-m",
        EMULATIONS[target],
        "-shared",
        "-soname",
        "libbirthsim.so",
        "-o",
        str(folder / "libbirthsim.so"),
        str(folder / "birthsim.o"),
    )
    write_header(images, bundle.rig.electronics.control_period, folder, beliefs(bundle, images))
    write_examples(images, folder)
    return {"target": target, "library": (folder / "libbirthsim.so").stat().st_size, **built}


def build_cortex(bundle: Bundle, folder: Path) -> Report:
    """Write the object of the laws alone, its header and an example; returns sizes in bytes, and what a period takes."""
    images = {name: words for name, words in bundle.images().items() if name.startswith(LAW)}
    built = _object(bundle, "cortex-m7", folder, images)
    write_header(images, bundle.rig.electronics.control_period, folder, beliefs(bundle, images))
    write_examples(images, folder, linked=False)
    assembly = folder / "birthsim.s"
    stack = stack_bytes(assembly.read_text(), "birthsim_advance", "birthsim_stage_")
    assembly.unlink()
    return {"target": "cortex-m7", **built, "stack": stack, "estimate": estimates(bundle)}


def build_threads(loops: Sequence[Loop], rig: Parameters, gpu: str | None, folder: Path) -> Report:
    """Write kernels, PTX or for one ``gpu`` a cubin, and the program of each loop; returns sizes in bytes, and what a thread
    takes where that is known."""
    functions, space, data = write_programs(loops, rig, folder)
    write_kernels(folder)
    compile_object(functions, "ptx", folder / "birthsim.o", threads=Threads(space))
    ptx = folder / "birthsim.ptx"
    report: Report = {"target": "ptx", "code": ptx.stat().st_size, "a lane of": data}
    if gpu is None:
        return report
    cubin = folder / "birthsim.cubin"
    thread = assemble(ptx, cubin, gpu)
    ptx.unlink()
    return {**report, "target": f"cubin for {gpu}", "code": cubin.stat().st_size, "thread": thread}


def _object(bundle: Bundle, target: str, folder: Path, images: Mapping[str, Words]) -> Report:
    compile_object(
        bundle.functions, target, folder / "birthsim.o", {f"birthsim_{name}": words for name, words in images.items()}
    )
    content = (folder / "birthsim.o").read_bytes()
    sizes = sections_of(content)

    def total(*prefixes: str) -> int:
        return sum(size for name, size in sizes.items() if name.startswith(prefixes))

    return {
        "text": total(".text"), "rodata": total(".rodata"), "data": total(".data"), "bss": total(".bss"),
        "loops": {name: 8 * len(words) for name, words in images.items()}, "needs": undefined_in(content),
    }  # fmt: skip
