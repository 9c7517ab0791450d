"""What the tests of the built code share."""

import importlib
import importlib.util
import os
import shutil
import sys

import numpy as np
import pytest
from llvmlite.binding import llvm_version_info

from birthsim.command_line.command import perform_with
from birthsim.exports import loops as loops
from birthsim_build.code import ptx
from birthsim_build.code.compiler import LEAST_LLVM
from birthsim_build.code.elf import contents_of
from birthsim_build.code.targets import HOST
from birthsim_build.device.machine import machine_named

BUILT = (
    "--controller", "admittance-backstepping", "limited:pid", "--policy", "circle", "circle_honest_student",
    "--sensors", "ideal", "lab",
)  # fmt: skip


def need(there, reason):
    """Skip where a tool is missing; under CI fail."""
    if not there:
        (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)(reason)


def imported(name):
    """A module; skip where it is missing, under CI fail."""
    return importlib.import_module(name) if os.environ.get("CI") == "true" else pytest.importorskip(name)


def need_program(name, package):
    need(shutil.which(name), f"{name} is missing: apt-get install {package}")


def need_linker():
    if llvm_version_info[0] < LEAST_LLVM:
        pytest.skip(f"LLVM {llvm_version_info[0]}; building needs {LEAST_LLVM}")
    need(importlib.util.find_spec("ziglang"), "ziglang is missing: pip install -e '.[build]'")


def need_threads():
    """Skip where the threads of a GPU cannot be run by this processor."""
    if HOST is None or llvm_version_info[0] < LEAST_LLVM:
        pytest.skip(f"needs Linux on x86-64 or aarch64, and LLVM {LEAST_LLVM}")


@pytest.fixture(params=["host", "cuda"])
def device(request):
    """The name of a device that is here."""
    need_threads()
    try:
        machine_named(request.param)
    except ValueError as missing:
        pytest.skip(str(missing))
    return request.param


def build(target, out, *options, command=loops):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["birthsim export", "--to", target, *map(str, options), "--out", str(out)])
        perform_with("birthsim export", command.Settings, command.main, "")


def fill(views, arrays):
    """Give the lanes of a device what ``arrays`` of the native ones hold; None is what all lanes share."""
    for view, array in zip(views, arrays, strict=True):
        if view is not None:
            view[...] = array


def assert_fusing_changes_nothing(folder, kernel, least):
    """Of code.ptx, whose ``kernel`` has at least so many bytes; what ptxas says of its memory, bytes."""
    if ptx.assembler() is None:
        pytest.skip("ptxas is missing: pip install nvidia-cuda-nvcc-cu12")
    made = []
    for fuses in ("true", "false"):
        taken = ptx.assemble(folder / "code.ptx", folder / "code.cubin", "sm_90", "--fmad", fuses)
        sections = contents_of((folder / "code.cubin").read_bytes())
        made.append({name: content for name, content in sections.items() if not name.startswith(".note")})
    assert made[0] == made[1]
    assert len(made[0][f".text.birthsim_{kernel}"]) > least
    return taken


def assert_same_bits(one, other):
    differs = np.ascontiguousarray(one).view(np.int64) != np.ascontiguousarray(other).view(np.int64)
    assert not differs.any(), f"first in period {differs.any(axis=1).argmax()}, columns {np.flatnonzero(differs.any(axis=0))}"
