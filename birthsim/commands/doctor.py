"""``birthsim doctor``: what works on this machine, and what to install for the rest."""

import os
import platform
import re
import shutil
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version

from birthsim.shadows import MEND, shadows

ABOUT = {
    "agents": "policies: train, explain, residual", "live": "the page: live", "onnx": "export --to onnx",
    "build": "export --to wasm, c, fmu", "log": "export --to parquet, mcap", "tune": "tune", "video": "films of episodes",
    "control": "linear models for python-control", "cluster": "--cluster ray",
    "sweep": "sweeps of trainings", "jax": "gradients for JAX", "cuda": 'device="cuda", export --to cubin',
}  # fmt: skip
"""Extra -> what it is for."""

INSTEAD = {"cupy-cuda12x": ("cupy-cuda13x", "cupy"), "nvidia-cuda-nvcc-cu12": ("nvidia-cuda-nvcc",)}
"""Distribution of an extra -> those that do as well."""

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "chromium-headless-shell")


@dataclass
class Settings:
    """Say what works on this machine, and what to install for the rest."""


def main(_: Settings) -> None:
    """Print it."""
    from birthsim_env.extras import installation
    from birthsim_env.physics.compiled import prebuilt
    from birthsim_env.physics.compiled.kept import cache_folder

    print(f"{'Python':12}{platform.python_version()}, {platform.system()} {platform.machine()}, {os.cpu_count()} processors")
    for name in ("birthsim", "gymnasium", "numpy", "numba", "llvmlite", "scipy", "torch"):
        print(f"{name:12}{found(name) or 'missing'}")
    print(f"{'prebuilt':12}{prebuilt.described()}")
    folder = cache_folder()
    held = 0 if folder is None else sum(1 for _ in folder.rglob("*.nbc"))
    print(
        f"{'kernels':12}"
        + ("no writable folder; mend: set NUMBA_CACHE_DIR" if folder is None else f"{held} compiled, in {folder}")
    )
    print(f"{'browser':12}{next(filter(None, map(shutil.which, BROWSERS)), 'none found; mend: any browser shows the page')}")
    print(f"{'GPU':12}{graphics()}")
    for name, place in shadows().items():
        print(f"{name:12}another package hides BirthSIM's: {place}; mend: {MEND}")
    print("\nextras")
    for extra, missing in extras().items():
        mend = installation(extra)
        print(f"{extra:12}{ABOUT.get(extra, ''):38}" + ("works" if not missing else mend))


def found(name: str) -> str | None:
    """The version of a distribution that is installed, else None."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def extras() -> dict[str, list[str]]:
    """Every extra that a user may want -> the distributions of it that are missing."""
    needed: dict[str, list[str]] = {extra: [] for extra in ABOUT}
    for line in requires("birthsim") or []:
        extra = re.search(r"extra == '(\w+)'", line)
        name = re.split(r"[^\w.-]", line, maxsplit=1)[0]
        if extra and extra[1] in needed and not any(map(found, (name, *INSTEAD.get(name, ())))):
            needed[extra[1]].append(name)
    return needed


def graphics() -> str:
    """What CuPy finds, which launches BirthSIM's kernels; no command needs a GPU."""
    try:
        import cupy
    except ImportError:
        return "not looked for, CuPy is missing (extra cuda); no command needs one"
    try:
        name = cupy.cuda.runtime.getDeviceProperties(0)["name"].decode()
    except cupy.cuda.runtime.CUDARuntimeError as error:
        return f"none for CuPy {cupy.__version__} ({error}); no command needs one"
    return f"{name}, by CuPy {cupy.__version__}"
