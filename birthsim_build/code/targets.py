"""Processors that are built for, as LLVM knows them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """A processor: LLVM's triple, processor and features, and how code is addressed (``reloc``)."""

    triple: str
    processor: str
    features: str
    reloc: str


TARGETS = {
    "wasm": Target(
        "wasm32-unknown-unknown", "generic", "+bulk-memory,+nontrapping-fptoint,+sign-ext,+mutable-globals", "static"
    ),
    "x86-64": Target("x86_64-unknown-linux-gnu", "x86-64", "", "pic"),
    "aarch64": Target("aarch64-unknown-linux-gnu", "generic", "", "pic"),
    "cortex-m7": Target("thumbv7em-none-eabihf", "cortex-m7", "+fp-armv8d16", "static"),
}
"""x86-64 and aarch64 in their first versions, which every processor of the family runs. No target fuses a product with a sum:
the code asks for none, and LLVM makes none unasked."""
