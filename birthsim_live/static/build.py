"""Builds the folder of static files: the page, the worker with its rig, and code, data and policies of the rig."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from birthsim_build.code.compiler import compile_object, link, require_linker, require_llvm
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.static.pack import Packer, pack, packed_policies

PAGE = Path(__file__).resolve().parent.parent / "page"
OVER = Path(__file__).resolve().parent / "page"
"""Files that are laid over those of the page: the connection to a worker, and the worker."""

STACK = 64 * 1024
"""Bytes of the stack of the stages, which take a tenth of it."""

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
    packer = Packer()
    rig_pack, stored = pack(rig, packer, policies), packed_policies(rig, packer, policies)
    with tempfile.TemporaryDirectory() as place:
        made = Path(place) / "page"
        shutil.copytree(PAGE, made / "static", ignore=shutil.ignore_patterns("index.html"))
        shutil.copytree(OVER, made / "static", dirs_exist_ok=True)
        (made / "index.html").write_text(_closed((PAGE / "index.html").read_text()))
        (made / "rig" / "policies").mkdir(parents=True)
        for name, content in {"pack.json": rig_pack, **stored}.items():
            (made / "rig" / name).write_text(_text(content))
        _write_code(packer.functions, Path(place), made / "rig" / "loop.wasm")
        shutil.copytree(made, folder, dirs_exist_ok=True)
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def _closed(page: str) -> str:
    """The page with the policy that the server sends as a header."""
    return page.replace("<head>", f'<head>\n  <meta http-equiv="Content-Security-Policy" content="{POLICY}">', 1)


def _text(content: dict[str, Any]) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def _write_code(functions: list[str], place: Path, out: Path) -> None:
    """Compile stages into a module that exports each as ``birthsim_stage_<number>``, and takes its memory from outside."""
    compiled = place / "stages.o"
    compile_object(functions, "wasm", compiled)
    exports = [f"--export=birthsim_stage_{number}" for number in range(len(functions))]
    link(
        "wasm-ld", "--no-entry", "--stack-first", "--import-memory", "--strip-all", "-z", f"stack-size={STACK}",
        "--export=__heap_base", *exports, str(compiled), "-o", str(out),
    )  # fmt: skip
