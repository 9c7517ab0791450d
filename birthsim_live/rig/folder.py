"""The page with a rig, as a folder of files that any server can show."""

import json
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agents.policy.shipped import loadable_for
from baselines.controller import RESIDUAL
from baselines.named import make_controller
from birthsim_build.faces.module import write_module
from birthsim_build.image import Words
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names
from birthsim_live.rig.words import controller_choice

PAGE = Path(__file__).resolve().parent.parent / "page"
"""HTML, JavaScript and, in ``rig``, what ``birthsim_live.rig.build`` has made of the paper's rig: ``loop.wasm``, which is the
code of every rig, ``loop.bin`` and ``pack.json``."""


@dataclass(frozen=True)
class Packed:
    """What the worker must know (``content``), the module's ``index``, and the ``words`` of all parts."""

    content: dict[str, Any]
    index: dict[str, Any]
    words: Words


def packed_page(rig: Parameters, policies: Sequence[str] = (), asked: Iterable[str] = ()) -> Packed:
    """What was built where that serves, else ``pack``; ``policies``, folders, are choices besides those that are shipped, and
    so are controllers that are ``asked`` for by name."""
    content = read_json("page", PAGE / "rig" / "pack.json", {"index": dict, "hello": {"choices": {"controller": list}}})
    built = Packed(content, content.pop("index"), np.fromfile(PAGE / "rig" / "loop.bin", dtype=np.int64))
    known = {one["name"] for one in content["hello"]["choices"]["controller"]}
    others = [name for name in dict.fromkeys([*asked, *(f"{RESIDUAL}:{one}" for one in policies)]) if name not in known]
    others = [name for name in others if ".py:" not in name]  # Python runs these
    if rig == Parameters() and not others and _lists_all(content):
        return built
    from birthsim_live.rig.pack import pack  # which takes a second to load

    return pack(rig, loadable_for(rig), content["functions"], others)


def _lists_all(content: dict[str, Any]) -> bool:
    """Whether every scenario and sensor model that is registered now was so when the page's rig was built."""
    listed = {kind: {one["name"] for one in content["hello"]["choices"][kind]} for kind in ("scenario", "sensors")}
    return all(set(names(kind)) <= known for kind, known in listed.items())


def offer(content: dict[str, Any], rig: Parameters, asked: Iterable[str] = ()) -> None:
    """Let a page (``Packed.content``) offer what is listed and not compiled or not built, and what is ``asked`` for by name.

    Raises ``ValueError`` for a controller that is none.
    """
    choices, asked = content["hello"]["choices"], list(asked)
    known = {one["name"]: one for one in choices["controller"]}
    listed = [*names("controller", listed=True), *(f"{RESIDUAL}:{name}" for name in loadable_for(rig))]
    for name in dict.fromkeys([*listed, *asked]):
        if name not in known:
            if name in asked:
                make_controller(name, rig)
            known[name] = {**controller_choice(name), "missing": ""}
            choices["controller"].append(known[name])
    content["python"] = [name for name, one in known.items() if "missing" in one]
    for name in content["python"]:
        known[name].pop("missing")
    choices["compare"][1:] = choices["controller"]


def write_page(folder: Path, packed: Packed, recording: Path | None = None) -> int:
    """Write the page of what is ``packed`` into ``folder``, which must be new or empty; its bytes. With a ``recording`` the
    page plays that.

    Raises ``ValueError`` for a folder with something in it.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ValueError(f"--static {str(folder)!r} is not empty; allowed: a new or empty folder")
    with tempfile.TemporaryDirectory() as place:
        made = Path(place) / "page"
        shutil.copytree(PAGE, made)
        own = made / "rig"
        (own / "pack.json").write_text(compact(packed.content))
        write_module(packed.index, own)
        packed.words.tofile(own / "loop.bin")
        if recording is not None:
            shutil.copyfile(recording, own / "replay.rec")
        shutil.copytree(made, folder, dirs_exist_ok=True)
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def compact(content: object) -> str:
    """It as JSON without spaces."""
    return json.dumps(content, separators=(",", ":"), allow_nan=False)
