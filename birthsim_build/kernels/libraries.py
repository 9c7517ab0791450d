"""The libraries that kernels are built for, and their targets."""

from birthsim_build.code.targets import TARGETS, Target

LIBRARIES = {
    "x86-64-v3.so": Target("x86_64-unknown-linux-gnu", "x86-64-v3", "", "pic"),
    "x86-64-v4.so": Target("x86_64-unknown-linux-gnu", "x86-64-v4", "+prefer-256-bit", "pic"),
    "aarch64.so": TARGETS["aarch64"],
    "x86-64-v3.dll": Target("x86_64-pc-windows-gnu", "x86-64-v3", "", "pic"),
    "aarch64.dylib": Target("arm64-apple-macosx11.0", "apple-m1", "", "pic"),
}
"""File, as ``compiled.prebuilt.target`` names it -> its target. Vectors of 512 bits would slow the clock of some processors."""

SHIPPED = ("x86-64-v3.so", "x86-64-v4.so", "aarch64.so")
"""Those that the package carries. The others are linked, but nobody has run them yet."""
