"""Processors that are built for, as LLVM knows them."""

import platform
from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """A processor: LLVM's triple, processor and features, and how code is addressed (``reloc``)."""

    triple: str
    processor: str
    features: str
    reloc: str


_WASM = "+bulk-memory,+nontrapping-fptoint,+sign-ext,+mutable-globals"

TARGETS = {
    "wasm": Target("wasm32-unknown-unknown", "generic", _WASM, "static"),
    "x86-64": Target("x86_64-unknown-linux-gnu", "x86-64-v2", "", "pic"),
    "x86-64-windows": Target("x86_64-pc-windows-gnu", "x86-64-v2", "", "pic"),
    "aarch64": Target("aarch64-unknown-linux-gnu", "generic", "", "pic"),
    "ptx": Target("nvptx64-nvidia-cuda", "sm_80", "+ptx80", "default"),
    "cortex-m7": Target("thumbv7em-unknown-none-eabihf", "cortex-m7", "+fp-armv8d16", "static"),
}
"""WebAssembly as browsers have it since 2021, x86-64 since 2009 (which rounds in an instruction), every aarch64, and a
Cortex-M7 with double precision. No target fuses a product with a sum: the code does not allow it, and LLVM then does not."""

BUILT = ("wasm", "x86-64", "aarch64", "cortex-m7", "ptx", "cubin")
"""Targets of ``birthsim export``; Windows has its FMUs only."""

HOST = {"x86_64": "x86-64", "aarch64": "aarch64"}.get(platform.machine()) if platform.system() == "Linux" else None
"""The target that runs on this machine; None where there is none."""
