"""Builds the folder of static files: the page, the worker with its rig, and code, data and policies of the rig."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from birthsim_build.building import write_wasm
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_build.faces.javascript import write_module
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.static.pack import pack

PAGE = Path(__file__).resolve().parent.parent / "page"
OVER = Path(__file__).resolve().parent / "page"
"""Files that are laid over those of the page: the connection to a worker, and the worker."""

POLICY = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "worker-src 'self'; base-uri 'none'; form-action 'none'"
)
"""The page may load its own files and nothing else; WebAssembly counts as a kind of eval."""


def build_page(folder: Path, rig: Parameters, policies: Sequence[str] = ()) -> int:
    """Write the page of ``rig`` into ``folder``, which must be new or empty; its bytes. ``policies`` are choices besides those
    that are shipped, and the first of them is what it opens with.

    Raises ``ValueError`` for a folder with something in it, a rig that the page cannot show, an old LLVM and a missing linker.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ValueError(f"--static {str(folder)!r} is not empty; allowed: a new or empty folder")
    require_llvm()
    require_linker()
    packed = pack(rig, policies)
    with tempfile.TemporaryDirectory() as place:
        made = Path(place) / "page"
        shutil.copytree(PAGE, made / "static", ignore=shutil.ignore_patterns("index.html"))
        shutil.copytree(OVER, made / "static", dirs_exist_ok=True)
        (made / "index.html").write_text(_closed((PAGE / "index.html").read_text()))
        own = made / "rig"
        own.mkdir()
        (own / "pack.json").write_text(json.dumps(packed.content, separators=(",", ":"), allow_nan=False))
        write_module(packed.index, own)
        packed.words.tofile(own / "loop.bin")
        write_wasm(packed.functions, own / "loop.wasm")
        shutil.copytree(made, folder, dirs_exist_ok=True)
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def _closed(page: str) -> str:
    """The page with the policy that the server sends as a header."""
    return page.replace("<head>", f'<head>\n  <meta http-equiv="Content-Security-Policy" content="{POLICY}">', 1)
