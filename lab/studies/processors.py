"""Runs the numeric tests as other processors would: ``make portable``.

Kernels are compiled for each, with a cache of its own; PyTorch, NumPy, OpenBLAS, oneDNN and the C library are held back to the
same instructions. What this machine's processor lacks is left out, and said. A setting can also be taken alone:
    python -m lab.studies.processors x86-64                      its tests
    python -m lab.studies.processors x86-64 -- COMMAND ...       any command under it
    python -m lab.studies.processors here                        the numeric tests on this processor as it is: ``make oldest``
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
NUMERIC = [f"tests/{room}" for room in ("oracles", "physics", "estimation", "contracts")]
"""Rooms whose tests depend on the bits of machine code, or on what LLVM makes of it; contracts run every law."""

_HASWELL = [
    *("sse", "sse2", "sse3", "ssse3", "sse4.1", "sse4.2", "popcnt", "avx", "avx2"),
    *("fma", "bmi", "bmi2", "lzcnt", "f16c", "movbe"),
]
_SKYLAKE = [*_HASWELL, "avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl"]

WARM = [sys.executable, "-m", "tests.warming"]
TESTS = [sys.executable, "-m", "pytest", "-n", "2", "-m", "not slow", *NUMERIC]


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
            "BIRTHSIM_PREBUILT": "0",
            "NUMBA_CPU_NAME": self.llvm,
            "NUMBA_CPU_FEATURES": ",".join(f"+{feature}" for feature in self.features),
            "NUMBA_CACHE_DIR": str(ROOT / "out" / "processors" / name),
            "NPY_DISABLE_CPU_FEATURES": " ".join(sorted(dispatched & set(self.numpy))),
            "GLIBC_TUNABLES": f"glibc.cpu.hwcaps={self.c_library}",
            "ATEN_CPU_CAPABILITY": self.torch,
            "OPENBLAS_CORETYPE": self.openblas,
            "ONEDNN_MAX_CPU_ISA": self.onednn,
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
    """Run the tests, or a command after ``--``, under every setting or those named; the exit status is 1 where any fails."""
    if platform.machine() not in ("x86_64", "AMD64"):
        raise SystemExit(f"these settings are x86-64's; this is {platform.machine()}")
    named, _, command = " ".join(sys.argv[1:]).partition("--")
    names = named.split() or list(PROCESSORS)
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
        environment = {**os.environ, **(processor.environment(name) if processor else {})}
        lines = [command.split()] if command else [WARM, TESTS]
        status = next(filter(None, (subprocess.run(line, cwd=ROOT, env=environment).returncode for line in lines)), 0)
        failed = failed or status != 0
        verdict = "passed" if status == 0 else f"FAILED ({status})"
        said.append(f"{name:8} {verdict} in {time.monotonic() - began:.0f} s")
    print("\n".join(said))
    raise SystemExit(failed)


if __name__ == "__main__":
    main()
