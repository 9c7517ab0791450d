"""Folders with the page without a server, and the address of one."""

from __future__ import annotations

import contextlib
import io
import shutil
import sys

import pytest

from agents.policy import seeds
from tests.build.targets import need_linker
from tests.live.browser import Folder

FEW = ["backstepping", "admittance-backstepping", "residual"]


def _built(tmp_path_factory, patch):
    """A folder, made by the command."""
    need_linker()
    from birthsim_live.commands.live import main

    folder = tmp_path_factory.mktemp("static") / "deeper" / "page"
    own = shutil.copytree(seeds.SHIPPED / "circle" / "seed_0", tmp_path_factory.mktemp("runs") / "own")
    patch.setattr(sys, "argv", ["birthsim live", "--static", str(folder), "--policy", str(own)])
    with contextlib.redirect_stdout(io.StringIO()) as said:
        main()
    assert f"written to {folder}" in said.getvalue()
    return folder


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """With all that is offered, which takes a minute to compile."""
    with pytest.MonkeyPatch.context() as patch:
        return _built(tmp_path_factory, patch)


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """With a few controllers."""
    from birthsim_live.rig import settings

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(settings, "listed_names", lambda: FEW)
        patch.setattr(seeds, "shipped_names", lambda: ["circle"])
        return _built(tmp_path_factory, patch)


@pytest.fixture(scope="session")
def address(built):
    """Of the page on a server of files, which has it below another folder."""
    with Folder(built.parent) as served:
        yield f"{served}{built.name}/"
