"""Real clients, each in a virtual environment of its own, on the wheel that a release would publish.

``python -m lab.studies.clients [NAME ...] [--keep] [--out FOLDER]``. One client after another gets a fresh environment, the
wheel and its packages, and runs its tests. Then the environment is removed, unless ``--keep`` is given: the disk holds one
at a time.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]


@dataclass(frozen=True)
class Client:
    """What stands in the client's environment beside the wheel.

    ``alone`` are packages that are installed without what they ask for. ``freed`` are names of ``constraints.txt`` that the
    client needs in another version.
    """

    extras: str
    needs: tuple[str, ...] = ()
    alone: tuple[str, ...] = ()
    freed: tuple[str, ...] = ()


CLIENTS = {
    "gymnasium": Client(extras="[video]"),
    "sb3": Client(extras="[agents]"),
    # CleanRL's last release asks for Python below 3.11 and for the old gym, which the file that is run here does not import.
    "cleanrl": Client(extras="[agents]", alone=("cleanrl==1.2.0",)),
    "torchrl": Client(extras="[agents]", needs=("torchrl==0.14.1",)),
    "skrl": Client(extras="[agents]", needs=("skrl==2.1.1",)),
    # Tianshou's virtualenv asks for filelock below 4; rliable, which it imports, is in an extra with old packages.
    "tianshou": Client(extras="[agents]", needs=("tianshou==2.0.1", "rliable==1.2.0"), freed=("filelock",)),
    # d3rlpy pins gymnasium 1.0.0; these are what it imports.
    "offline": Client(
        extras="[agents]",
        needs=("minari[hdf5,create]==0.5.4", "click", "colorama", "dataclasses-json", "gym", "scikit-learn", "structlog"),
        alone=("d3rlpy==2.8.1",),
    ),
    "cluster": Client(extras="[cluster,build]"),
    # Never ray[rllib]: it pins gymnasium 1.2.2. These are what RLlib imports.
    "rllib": Client(
        extras="[agents]",
        needs=("ray==2.60.0", "dm-tree", "lz4", "ormsgpack", "pyarrow", "pandas", "tensorboardX", "pydantic", "requests"),
    ),
    # Its table writer asks for python-dateutil below 3; its player imports requests without asking for it.
    "rl_zoo": Client(extras="[agents]", needs=("rl_zoo3==2.9.2", "requests"), freed=("python-dateutil",)),
}


def wheel(out: Path) -> Path:
    """Builds the wheel of this checkout."""
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(out), str(ROOT)], check=True
    )
    return next(out.glob("birthsim-*.whl"))


def constraints(client: Client, path: Path) -> Path:
    """Writes ``constraints.txt`` without the names that the client frees."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if line.split("==")[0] not in client.freed), encoding="utf-8")
    return path


def install(client: Client, built: Path, folder: Path) -> Path:
    """Makes the environment; returns its interpreter."""
    subprocess.run([sys.executable, "-m", "venv", str(folder / "venv")], check=True)
    python = folder / "venv" / "bin" / "python"
    pip = [str(python), "-m", "pip", "--disable-pip-version-check", "--no-input", "install", "--quiet"]
    bounds = ["--constraint", str(constraints(client, folder / "constraints.txt"))]
    subprocess.run([*pip, *bounds, f"{built}{client.extras}", "pytest", *client.needs], check=True)
    if client.alone:
        subprocess.run([*pip, "--no-deps", "--ignore-requires-python", *client.alone], check=True)
    return python


def attempt(name: str, built: Path, out: Path, keep: bool) -> bool:
    """Installs a client and runs its tests; says what became of it."""
    folder, started = out / name, time.perf_counter()
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "work").mkdir(parents=True)
    try:
        python = install(CLIENTS[name], built, folder)
    except subprocess.CalledProcessError:
        print(f"{name}: could not be installed", flush=True)
        return False
    installed = time.perf_counter()
    # -P: the checkout in the working directory or beside the tests must not take the place of the wheel.
    tests = [
        str(python),
        "-P",
        "-m",
        "pytest",
        "-c",
        str(HERE / "pytest.ini"),
        "--rootdir",
        str(HERE),
        "--confcutdir",
        str(HERE),
    ]
    fine = (
        subprocess.run(
            [*tests, "--basetemp", str(folder / "temporary"), str(HERE / f"test_{name}.py")],
            cwd=folder / "work",
            env={**os.environ, "OMP_NUM_THREADS": "1", "RAY_USAGE_STATS_ENABLED": "0", "SDL_VIDEODRIVER": "dummy"},
            check=False,
        ).returncode
        == 0
    )
    size = sum(path.lstat().st_size for path in (folder / "venv").rglob("*")) / 1e9
    ended = time.perf_counter()
    print(
        f"{name}: {'passed' if fine else 'FAILED'}; {size:.2f} GB, {installed - started:.0f} s to install, "
        f"{ended - installed:.0f} s of tests",
        flush=True,
    )
    if not keep:
        shutil.rmtree(folder)
    return fine


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m lab.studies.clients", description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"clients; all of {', '.join(CLIENTS)} where none is named")
    parser.add_argument("--keep", action="store_true", help="leave the environments on the disk")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "weekly", help="where environments are made")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in CLIENTS]
    if unknown:
        parser.error(f"{', '.join(unknown)}: allowed are {', '.join(CLIENTS)}")
    out = arguments.out.resolve()
    built = wheel(out / "wheel")
    results = {name: attempt(name, built, out, arguments.keep) for name in arguments.names or CLIENTS}
    print(f"{sum(results.values())} passed, {len(results) - sum(results.values())} failed")
    return 0 if all(results.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
