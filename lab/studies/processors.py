"""Runs the tests of bits as other processors would: ``make portable``.

Kernels are compiled for each, with a cache of its own; PyTorch, NumPy, OpenBLAS, oneDNN and the C library are held back to the
same instructions. What this machine's processor lacks is left out, and said. A setting can also be taken alone:
    python -m lab.studies.processors x86-64                      its tests
    python -m lab.studies.processors x86-64 -- COMMAND ...       any command under it
    python -m lab.studies.processors here                        the tests of bits with Numba as it is: ``make oldest``

What depends on a processor is the bits of machine code, so what is tested is bits, and the rest follows from them: equal bits
pass every other test as they do in ``make test``. Stored fingerprints are of all scenarios and controllers, three lanes at a
time, which is less than a vector register has; that a lane of many has the bits of one alone leads from there to vectors, for
every law, sensor, hand, impedance and option. Elementary functions are compared with plain Python. Refusals, files, commands
and statistics are not repeated: they have no machine code, or hold for these bits.

As ``avx2`` the library that comes with the package runs; all other settings have Numba compile, as after an edit. ``here``
also runs what asks the most of Numba's interface, which its versions change: users' own stages and generated code.
``make portable`` leaves ``avx512`` out, which takes as long as the others together: a processor that has it runs the library
for AVX-512 in ``make test``, and Numba's code for it in ``make oldest``.
"""

import os
import platform
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from llvmlite.binding import get_host_cpu_features
from numpy._core import _multiarray_umath  # type: ignore[attr-defined]

ROOT = Path(__file__).resolve().parents[2]
CONTRACTS = "tests/contracts/test_"
BITS = [
    "tests/oracles/test_golden.py",
    "tests/physics/compiled/test_exact.py",
    f"{CONTRACTS}controllers.py::test_one_rig_is_a_lane_of_many_and_a_reset_starts_it_alone",
    f"{CONTRACTS}environments.py::test_a_lane_is_the_environment_alone_through_its_episodes",
]
INTERFACE = [
    *("tests/physics/compiled", "tests/gradients/test_tracing.py", "tests/gradients/test_loop.py"),
    *(f"{CONTRACTS}own_parts.py", f"{CONTRACTS}own_callables.py", f"{CONTRACTS}extensions.py", f"{CONTRACTS}copies.py"),
]

_HASWELL = [
    *("sse", "sse2", "sse3", "ssse3", "sse4.1", "sse4.2", "popcnt", "avx", "avx2"),
    *("fma", "bmi", "bmi2", "lzcnt", "f16c", "movbe"),
]
_SKYLAKE = [*_HASWELL, "avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl"]

SHIPPED = "avx2"
"""The setting as which the library of the package runs; it has x86-64-v3 code."""

OTHERS = ("x86-64", SHIPPED)
"""Settings under which nothing else runs."""

NUMBA = {"BIRTHSIM_PREBUILT": "0"}
"""Has Numba compile what the library has too."""

WARM = [sys.executable, "-m", "tests.warming"]
# Policies have one law and one network's code in common: the contract of ``residual`` is theirs.
TESTS = [sys.executable, "-m", "pytest", "-n", "2", "-m", "not slow", "-k", "not policy", *BITS]


@dataclass(frozen=True)
class Processor:
    """What a processor is called by those who choose code by it: LLVM, NumPy (what it must not use), the C library (likewise),
    PyTorch, OpenBLAS and oneDNN."""

    llvm: str
    features: tuple[str, ...]
    numpy: tuple[str, ...]
    c_library: str
    torch: str
    openblas: str
    onednn: str

    def missing(self) -> list[str]:
        """Features that this machine lacks."""
        own = get_host_cpu_features()
        return [name for name in self.features if not own.get(name)]

    def environment(self, name: str) -> dict[str, str]:
        """Variables that make a process believe that it runs there."""
        # NumPy warns of a feature that it could not have used anyway.
        dispatched = {name for name, used in _multiarray_umath.__cpu_features__.items() if used}
        dispatched &= set(_multiarray_umath.__cpu_dispatch__)
        return {
            "NUMBA_CPU_NAME": self.llvm,
            "NUMBA_CPU_FEATURES": ",".join(f"+{feature}" for feature in self.features),
            "NUMBA_CACHE_DIR": str(ROOT / "out" / "processors" / name),
            "NPY_DISABLE_CPU_FEATURES": " ".join(sorted(dispatched & set(self.numpy))),
            "GLIBC_TUNABLES": f"glibc.cpu.hwcaps={self.c_library}",
            "ATEN_CPU_CAPABILITY": self.torch,
            "OPENBLAS_CORETYPE": self.openblas,
            "ONEDNN_MAX_CPU_ISA": self.onednn,
            **({} if name == SHIPPED else NUMBA),
        }


_BEYOND_AVX2 = ("X86_V4", "AVX512_ICL", "AVX512_SPR")
PROCESSORS = {
    "x86-64": Processor(
        *("x86-64", ("sse", "sse2"), ("X86_V3", *_BEYOND_AVX2), "-AVX2,-FMA,-FMA4,-AVX512F", "default", "Nehalem", "SSE41")
    ),
    "avx2": Processor("haswell", tuple(_HASWELL), _BEYOND_AVX2, "-AVX512F", "avx2", "Haswell", "AVX2"),
    "avx512": Processor("skylake-avx512", tuple(_SKYLAKE), (), "", "avx512", "SkylakeX", "AVX512_CORE"),
}


def main() -> None:
    """Run the tests, or a command after ``--``, under ``OTHERS`` or settings that are named; status 1 where any fails."""
    if platform.machine() not in ("x86_64", "AMD64"):
        raise SystemExit(f"these settings are x86-64's; this is {platform.machine()}")
    named, _, command = " ".join(sys.argv[1:]).partition("--")
    names = named.split() or list(OTHERS)
    unknown = [name for name in names if name not in (*PROCESSORS, "here")]
    if unknown:
        raise SystemExit(f"{unknown[0]!r}; allowed: {', '.join(PROCESSORS)}, here")
    said, failed = [], False
    for name in names:
        processor = PROCESSORS.get(name)
        if processor and processor.missing():
            said.append(f"{name:8} left out: this processor has no {', '.join(processor.missing())}")
            continue
        print(f"== as {name}", flush=True)
        began = time.monotonic()
        environment = {**os.environ, **(processor.environment(name) if processor else NUMBA)}
        lines = [command.split()] if command else [WARM, TESTS if processor else [*TESTS, *INTERFACE]]
        status = next(filter(None, (subprocess.run(line, cwd=ROOT, env=environment).returncode for line in lines)), 0)
        failed = failed or status != 0
        verdict = "passed" if status == 0 else f"FAILED ({status})"
        said.append(f"{name:8} {verdict} in {time.monotonic() - began:.0f} s")
    print("\n".join(said))
    raise SystemExit(failed)


if __name__ == "__main__":
    main()
