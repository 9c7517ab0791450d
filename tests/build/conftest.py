import os

import pytest
from filelock import FileLock

from birthsim.exports import fmu
from birthsim_build.code.targets import HOST
from birthsim_build.device import machine
from birthsim_build.device.program import Pieces
from lab.studies.targets.reference import PERIODS
from lab.studies.targets.running import node_rows
from tests.build.loops import every_function
from tests.build.targets import BUILT, build, device, need_linker, need_program

__all__ = ["device"]


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


@pytest.fixture(scope="session")
def cortex(tmp_path_factory):
    return _once(tmp_path_factory, "cortex-m7", "--controller", "admittance-backstepping", "--sensors", "ideal", "lab")


@pytest.fixture
def in_one_code(monkeypatch, request):
    """Programs have the code of all loops of ``tests.build.loops``, and rows for each, so that it is compiled once for all."""
    seldom = request.node.get_closest_marker("weekly") is not None
    own, functions = Pieces.functions.fget, every_function(seldom)
    monkeypatch.setattr(Pieces, "functions", property(lambda pieces: sorted({*functions, *own(pieces)})))
    monkeypatch.setattr(machine, "ROOM", 1024)


@pytest.fixture
def in_node(wasm, tmp_path):
    """Rows of a built loop in JavaScript; ``make`` is a method of ``Bundle`` and its arguments."""
    need_program("node", "nodejs")
    return lambda name, *make, **options: node_rows(wasm, list(make), tmp_path, PERIODS, **options)[0]


@pytest.fixture(scope="session")
def written(tmp_path_factory):
    """Writes an FMU of some options, once."""
    need_linker()
    folder, made = tmp_path_factory.mktemp("fmu"), {}

    def write(*options):
        if options not in made:
            build("fmu", folder / f"{len(made)}.fmu", *options, command=fmu)
            made[options] = folder / f"{len(made)}.fmu"
        return made[options]

    return write


@pytest.fixture
def unit():
    """Makes instances of FMUs."""
    from tests.build.fmus import Unit  # needs FMPy

    made = []

    def make(path, **parameters):
        made.append(Unit(path, **parameters))
        return made[-1]

    yield make
    for one in made:
        one.close()
