"""A folder with the page without a server, and its address."""

from __future__ import annotations

import shutil

import pytest

from agents.policy.seeds import SHIPPED
from tests.build.targets import need_linker
from tests.console import run
from tests.live.browser import Folder


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder, made by the command."""
    need_linker()
    folder = tmp_path_factory.mktemp("static") / "deeper" / "page"
    own = shutil.copytree(SHIPPED / "circle" / "seed_0", tmp_path_factory.mktemp("runs") / "own")
    done = run("live", "--static", folder, "--policy", own)
    assert done.returncode == 0, done.stderr
    assert f"written to {folder}" in done.stdout
    return folder


@pytest.fixture(scope="module")
def address(built):
    """Of the page on a server of files, which has it below another folder."""
    with Folder(built.parent) as served:
        yield f"{served}{built.name}/"
