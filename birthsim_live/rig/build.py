"""Builds what the package carries of the page's rig: ``python -m birthsim_live.rig.build``, after a change of kernels,
policies, words or version. It needs the extras ``agents`` and ``build``; ``tests/live/rig/test_built.py`` compares."""

from pathlib import Path

from agents.policy.shipped import loadable_for
from birthsim_build.building import write_wasm
from birthsim_build.code.compiler import require_linker, require_llvm
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.folder import PAGE, compact
from birthsim_live.rig.learning import write_learning
from birthsim_live.rig.pack import pack


def build(folder: Path) -> None:
    """Write the code and data of the paper's rig into ``folder``, and those with which a controller learns."""
    require_llvm()
    require_linker()
    rig = Parameters()
    packed = pack(rig, loadable_for(rig))
    (folder / "pack.json").write_text(compact({**packed.content, "index": packed.index}) + "\n", encoding="utf-8")
    packed.words.tofile(folder / "loop.bin")
    write_wasm(packed.content["functions"], folder / "loop.wasm")
    write_learning(folder)


if __name__ == "__main__":
    (PAGE / "rig").mkdir(exist_ok=True)
    build(PAGE / "rig")
