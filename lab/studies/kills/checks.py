"""What a folder holds after a command: whole files, leftovers, and whether results are equal to others."""

import hashlib
import json
import re
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from zipfile import ZipFile

import numpy as np
from PIL import Image

from birthsim_env.partials import HIDDEN
from lab.studies.kills.processes import Running
from lab.studies.kills.targets import Target

_BAR = re.compile(r"\d+%\||\[\d\d:\d\d[<,]|BirthSIM: compiling")
"""Progress bars, and the word while kernels compile."""


_FOREIGN = (".ses", "torchinductor_*")
"""What onnxruntime and PyTorch keep among temporary files, under names that stay the same."""


MADE = ("command", "date", "seconds", "pieces_kept")
"""Keys of a study's result that say when and how it was made."""


def _json(path: Path) -> None:
    json.loads(path.read_text(encoding="utf-8"))


def _journal(path: Path) -> None:
    # What is appended may lack its last line's end: the next run takes the line away.
    for line in path.read_text(encoding="utf-8").split("\n")[:-1]:
        json.loads(line)


def _picture(path: Path) -> None:
    with Image.open(path) as picture:
        for frame in range(getattr(picture, "n_frames", 1)):
            picture.seek(frame)
            picture.load()


def _svg(path: Path) -> None:
    ElementTree.parse(path)


def _safetensors(path: Path) -> None:
    from safetensors import safe_open

    with safe_open(path, framework="numpy") as content:
        for name in content.keys():  # noqa: SIM118  it is no dictionary
            content.get_tensor(name)


def _onnx(path: Path) -> None:
    import onnx

    onnx.checker.check_model(onnx.load(path))


def _parquet(path: Path) -> None:
    from pyarrow import parquet

    parquet.read_table(path)


def _mcap(path: Path) -> None:
    from mcap.reader import make_reader

    with path.open("rb") as file:
        for _ in make_reader(file).iter_messages():
            continue


def _zip(path: Path) -> None:
    with ZipFile(path) as archive:
        if (damaged := archive.testzip()) is not None:
            raise ValueError(f"{damaged} is damaged")


def _dataset(path: Path) -> None:
    import h5py

    with h5py.File(path) as content:
        for episode in content.values():
            for array in ("observations", "actions", "rewards"):
                np.asarray(episode[array])


def _text(path: Path) -> None:
    if not path.read_text(encoding="utf-8").endswith("\n"):
        raise ValueError("the last line has no end")


READERS: dict[str, Callable[[Path], Any]] = {
    ".json": _json, ".journal": _journal, ".png": _picture, ".webp": _picture, ".gif": _picture, ".svg": _svg,
    ".safetensors": _safetensors, ".onnx": _onnx, ".parquet": _parquet, ".mcap": _mcap,
    ".fmu": _zip, ".hdf5": _dataset, ".md": _text, ".csv": _text,
}  # fmt: skip


def files_in(folder: Path) -> list[Path]:
    """All files below a folder."""
    return sorted(path for path in folder.rglob("*") if path.is_file() or path.is_symlink())


def is_leftover(path: Path, folder: Path) -> bool:
    """Whether a file is one that only a running command needs."""
    parts = path.relative_to(folder).parts
    return any(part == HIDDEN or part.endswith(".tmp") for part in parts) or path.is_symlink()


def leftovers(folder: Path) -> list[str]:
    """Names below a folder that a command has left behind; the lock of a folder stays and is empty."""
    return [str(path.relative_to(folder)) for path in files_in(folder) if is_leftover(path, folder)]


def broken(folder: Path) -> list[str]:
    """The files below a folder that cannot be read to their end, but for leftovers, which nobody reads."""
    found = []
    for path in files_in(folder):
        if not is_leftover(path, folder) and path.suffix in READERS:
            try:
                READERS[path.suffix](path)
            except Exception as error:
                found.append(f"{path.relative_to(folder)}: {error}"[:200])
    return found


def results(target: Target, folder: Path) -> dict[str, str]:
    """Name -> digest of what a command has written, without what differs from run to run."""
    return {
        str(path.relative_to(folder)): _digest(path, target.costs if path.parent != folder else MADE)
        for path in files_in(folder)
        if not any(fnmatch(path.name, pattern) for pattern in (*target.differ, ".lock")) and not is_leftover(path, folder)
    }


def merged(found: dict[str, str]) -> dict[str, str]:
    """Of ``results``, those that stand for the whole, not for a piece of it."""
    return {name: digest for name, digest in found.items() if "/" not in name}


def pieces(found: dict[str, str]) -> dict[str, str]:
    """Of ``results``, those that stand for pieces."""
    return {name: digest for name, digest in found.items() if "/" in name}


def _digest(path: Path, without: tuple[str, ...]) -> str:
    content = path.read_bytes()
    if without and path.suffix == ".json":
        content = json.dumps(_stripped(json.loads(content), without)).encode()
    return hashlib.sha256(content).hexdigest()


def _stripped(content: Any, without: tuple[str, ...]) -> Any:
    if isinstance(content, dict):
        return {key: _stripped(value, without) for key, value in content.items() if key not in without}
    return [_stripped(value, without) for value in content] if isinstance(content, list) else content


def said(stderr: str) -> list[str]:
    """The lines that a command has complained in."""
    lines = [line.strip() for line in re.split(r"[\r\n]+", stderr)]
    return [line for line in lines if line and not _BAR.search(line)]


def remains(running: Running) -> list[str]:
    """Temporary files and semaphores that the processes of an ended session have left."""
    files = [
        f"TMPDIR/{path.relative_to(running.temporary)}"
        for path in running.temporary.rglob("*")
        if not any(fnmatch(part, name) for part in path.relative_to(running.temporary).parts for name in _FOREIGN)
    ]
    return files + [path.name for path in Path("/dev/shm").glob(f"sem.loky-{running.process.pid}-*")]
