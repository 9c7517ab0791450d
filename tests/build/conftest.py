import json

import pytest
from filelock import FileLock

from tests.build.targets import BUILT, build, need_linker


def _once(tmp_path_factory, target, *options):
    """A folder of birthsim-build, made by the first worker that asks for it."""
    need_linker()
    root = (
        tmp_path_factory.getbasetemp().parent
        if "PYTEST_XDIST_WORKER" in __import__("os").environ
        else tmp_path_factory.getbasetemp()
    )
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
    return _once(tmp_path_factory, "x86-64", *BUILT)


@pytest.fixture(scope="session")
def sizes(library):
    """Bytes of each loop of the library."""
    return json.loads((library / "build.json").read_text())["loops"]
