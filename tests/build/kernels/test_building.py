"""How prebuilt kernels are built: the same bytes wherever and in whatever order, and every kind of argument."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from birthsim_build.code.elf import undefined_in
from birthsim_build.kernels.__main__ import ENVIRONMENT
from birthsim_build.kernels.kinds import result_of, types_of
from birthsim_build.kernels.libraries import LIBRARIES, SHIPPED
from birthsim_build.kernels.recording import record
from birthsim_env.physics.compiled import prebuilt
from tests.build.kernels import own
from tests.build.targets import need_linker
from tests.console import ROOT


def build(out, work, seed="0", *how):
    environment = {**os.environ, **ENVIRONMENT, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(work)}
    line = [sys.executable, "-m", "tests.build.kernels.own", str(out), str(work), *how]
    subprocess.run(line, check=True, env=environment, cwd=out.parent, capture_output=True, text=True)
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in out.iterdir()}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A folder like ``birthsim_env/prebuilt`` with the kernels of ``own``, and hashes of its files."""
    need_linker()
    folder = tmp_path_factory.mktemp("built")
    return folder / "prebuilt", build(folder / "prebuilt", folder / "work")


@pytest.fixture
def code(built, monkeypatch):
    """What runs a kernel for some arguments from there."""
    if prebuilt.target() not in SHIPPED:
        pytest.skip("no library runs here")
    monkeypatch.setattr(prebuilt, "FOLDER", built[0])
    monkeypatch.setattr(prebuilt, "USED", True)
    prebuilt._opened.cache_clear()

    def of(kernel, *arguments):
        ready = prebuilt.function(kernel, tuple(map(prebuilt.kind_of, arguments)))
        return ready and ready(*arguments)

    yield of
    prebuilt._opened.cache_clear()


def test_the_bytes_depend_on_neither_folder_nor_order_nor_hashes(built, tmp_path):
    assert build(tmp_path / "another", tmp_path / "work", "7", "reversed") == built[1]


def test_a_build_that_compiles_nothing_has_the_same_bytes(built):
    folder = built[0].parent
    kept = {path: path.stat().st_mtime_ns for path in (folder / "work" / "objects").iterdir()}
    assert build(folder / "again", folder / "work") == built[1]
    assert {path: path.stat().st_mtime_ns for path in (folder / "work" / "objects").iterdir()} == kept


DERIVED = {"_directions", "_answer", "_forward", "_backward", "adjoint"}
"""Kernels of derivatives."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "kernels"),
    [("physics", {"_directions"}), pytest.param("train by gradients", DERIVED, marks=pytest.mark.weekly)],
)
def test_a_path_asks_for_the_same_again(path, kernels, tmp_path):
    """What it has left, a policy and derivatives that were traced, would ask for less."""
    first, second = (record([path], prebuilt.FOLDER, tmp_path / "work") for _ in range(2))
    assert first == second
    assert kernels <= {key.partition(" ")[0].rpartition(".")[2] for key in first[0]}


@pytest.mark.slow
@pytest.mark.weekly
def test_libraries_for_windows_and_macos_are_linked(built, tmp_path):
    """Nobody has run them. The linker first compiles what every program of these systems has, three minutes of it."""
    files = build(tmp_path / "every", tmp_path / "work", "0", "every")
    assert {name: files[name] for name in SHIPPED} == {name: built[1][name] for name in SHIPPED}
    heads = {name: (tmp_path / "every" / name).read_bytes()[:4] for name in LIBRARIES if name not in SHIPPED}
    assert heads == {"x86-64-v3.dll": b"MZ\x78\x00", "aarch64.dylib": b"\xcf\xfa\xed\xfe"}


def test_a_library_knows_no_path_and_asks_for_memory_alone(built):
    for name in SHIPPED:
        content = (built[0] / name).read_bytes()
        assert [word for word in (b"/work", str(ROOT).encode(), b"numba", b".py") if word in content] == []
        assert set(undefined_in(content)) <= {"malloc", "free", "memset", "memcpy", "memmove"}


def test_numbers_of_every_kind(code):
    assert code(own.numbers, 3, 0.5, True, np.uint64(4)) == 3.5
    assert code(own.numbers, 3, 0.5, False, np.uint64(2**63)) == 1.0 + 2.0**63
    assert code(own.counted, -3, 4) == -26
    assert (code(own.is_large, 101.0), code(own.is_large, 99.0)) == (True, False)


def frozen(array):
    array.flags.writeable = False
    return array


def every_second(array):
    return np.repeat(array, 2, 1)[:, ::2]


@pytest.mark.parametrize("changed", [np.ascontiguousarray, np.asfortranarray, every_second, frozen, np.float32])
def test_arrays_of_every_order(code, changed):
    array, result = changed(np.arange(12.0).reshape(3, 4)), np.zeros(3)
    assert code(own.summed, array, result) is None
    assert result.tolist() == [6.0, 22.0, 38.0]


def test_rows_by_name(code):
    result = np.zeros(2)
    code(own.named, own.Pair(np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])), result)
    assert result.tolist() == [16.0, 26.0]


def test_of_other_kinds_there_is_none(code):
    assert code(own.summed, np.zeros((2, 2), np.complex128), np.zeros(2)) is None
    assert code(own.counted, 1, 2.0) is None


def test_a_kernel_may_return_a_number_or_nothing():
    with pytest.raises(ValueError, match=r"returns .*; allowed: int64, float64, bool, uint64, none"):
        result_of(types_of(own.summed, ["d2C", "d1C"])[0])
