"""The libraries that kernels are built for: their targets, and how objects become one."""

import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from birthsim_build.code.compiler import EMULATIONS, link
from birthsim_build.code.targets import TARGETS, Target
from birthsim_build.code.tools import run_tool

LIBRARIES = {
    "x86-64-v3.so": Target("x86_64-unknown-linux-gnu", "x86-64-v3", "", "pic"),
    "aarch64.so": TARGETS["aarch64"],
    "x86-64-v3.dll": Target("x86_64-pc-windows-gnu", "x86-64-v3", "", "pic"),
    "aarch64.dylib": Target("arm64-apple-macosx11.0", "apple-m1", "", "pic"),
}
"""File, as ``compiled.prebuilt.target`` names it -> its target."""

SHIPPED = ("x86-64-v3.so", "aarch64.so")
"""Those that the package carries. The others are linked, but nobody has run them yet."""

_ZIG = {"x86-64-v3.dll": "x86_64-windows-gnu", "aarch64.dylib": "aarch64-macos"}


def join(name: str, objects: Mapping[str, bytes], out: Path) -> None:
    """Write the library ``name`` of objects, by their symbols, to ``out``; ``ValueError`` where the linker refuses.

    It depends on nothing but their content: no path, no time and no order of theirs stands in it.
    """
    with tempfile.TemporaryDirectory() as folder:
        places = []
        for symbol, content in sorted(objects.items()):
            places.append(str(Path(folder) / f"{symbol}.o"))
            Path(places[-1]).write_bytes(content)
        if name.endswith(".so"):
            machine = EMULATIONS[name.removesuffix(".so").removesuffix("-v3")]
            how = ("-shared", "--strip-all", "--gc-sections", "--hash-style=gnu", "--build-id=none", "-z", "separate-code")
            link("ld.lld", "-m", machine, *how, "-o", str(out), *places)
            return
        done = run_tool(sys.executable, "-m", "ziglang", "cc", "-target", _ZIG[name], "-shared", "-s", "-o", str(out), *places)
        if done.returncode:
            raise ValueError(f"the linker refuses {name}: {done.stderr.strip().splitlines()[:1]}")
