import os

import pytest
from filelock import FileLock

from birthsim_build.code.targets import HOST
from tests.build.targets import BUILT, build, need_linker


def _once(tmp_path_factory, target, *options):
    """A folder of birthsim export, made by the first worker that asks for it."""
    need_linker()
    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root
    folder = root / "built" / target
    with FileLock(str(root / f"{target}.lock")):
        if not (folder / "build.json").is_file():
            build(target, folder, *options)
    return folder


@pytest.fixture(scope="session")
def wasm(tmp_path_factory):
    return _once(tmp_path_factory, "wasm", *BUILT)


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    if HOST is None:
        pytest.skip("no shared library runs here; allowed: Linux on x86-64 or aarch64")
    return _once(tmp_path_factory, HOST, *BUILT)
