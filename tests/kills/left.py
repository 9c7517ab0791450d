"""What a folder holds after a command: results, pieces of them, leftovers, files that are torn."""

import hashlib
import json
from fnmatch import fnmatch
from xml.etree import ElementTree

from PIL import Image

from birthsim_env.partials import HIDDEN

MADE = {"command", "date", "seconds", "pieces_kept"}
"""Keys of JSON files that say when and how they were made."""

CLOCKS = {"seconds", "cost", "sha256", "environment_fraction", "split", "used", "code"}
"""Keys of a piece, in a folder below, that say how long it took, what its process had used before, or hash what does."""

CHANGING = ("times.json", "checkpoint.safetensors", "events.*", "trials.journal", ".lock")
"""Files that differ from run to run."""


def _files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file() or path.is_symlink())


def _is_left(path, folder):
    parts = path.relative_to(folder).parts
    return path.is_symlink() or any(part == HIDDEN or part.endswith(".tmp") for part in parts)


def leftovers(folder):
    """Files that only a running command needs; the lock of a folder stays and is empty."""
    return [str(path.relative_to(folder)) for path in _files(folder) if _is_left(path, folder)]


def results(folder):
    """Name -> digest of what a command has written, without clocks."""
    return {
        str(path.relative_to(folder)): _digest(path, MADE if path.parent == folder else CLOCKS)
        for path in _files(folder)
        if not _is_left(path, folder) and not any(fnmatch(path.name, pattern) for pattern in CHANGING)
    }


def wholes(found):
    """Of ``results``, those that stand for the whole, not for a piece of it."""
    return {name: digest for name, digest in found.items() if "/" not in name}


def pieces(found):
    """The others."""
    return {name: digest for name, digest in found.items() if "/" in name}


def _digest(path, without):
    content = path.read_bytes()
    if path.suffix == ".json":
        content = json.dumps(_steady(json.loads(content), without)).encode()
    return hashlib.sha256(content).hexdigest()


def _steady(content, without):
    if isinstance(content, dict):
        return {key: _steady(value, without) for key, value in content.items() if key not in without}
    return [_steady(value, without) for value in content] if isinstance(content, list) else content


def assert_whole(folder):
    """What can be read can be read to its end; of a journal the next run takes away a last line that is half."""
    for path in _files(folder):
        if _is_left(path, folder):
            continue
        match path.suffix:
            case ".json":
                json.loads(path.read_text(encoding="utf-8"))
            case ".journal":
                list(map(json.loads, path.read_text(encoding="utf-8").split("\n")[:-1]))
            case ".png" | ".webp" | ".gif":
                with Image.open(path) as picture:
                    for frame in range(getattr(picture, "n_frames", 1)):
                        picture.seek(frame)
                        picture.load()
            case ".svg":
                ElementTree.parse(path)
            case ".md" | ".csv":
                assert path.read_text(encoding="utf-8").endswith("\n"), path
