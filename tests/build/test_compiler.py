"""Objects are kept by what they are made of, and a damaged one costs a compilation only."""

import numpy as np
import pytest

from birthsim_build.code import compiler
from birthsim_build.code.compiler import compile_object

STAGE = "birthsim_env.loop.world:_plant"
DATA = {"birthsim_image": np.arange(3)}


@pytest.fixture
def compile_one(tmp_path, monkeypatch):
    """Compiles by counting: the object of the n-th compilation is n; returns the object and, for ARM, the assembly."""
    made = []

    def compiled(request, arrays):
        made.append(request)
        return {".o": b"%d" % len(made), **({".s": b"assembly"} if request["target"] == "cortex-m7" else {})}

    (tmp_path / "kept").mkdir()
    monkeypatch.setattr(compiler, "cache_folder", lambda: tmp_path / "kept")
    monkeypatch.setattr(compiler, "_compiled", compiled)

    def compile_one(target="wasm", data=DATA, **options):
        for left in tmp_path.glob("code.*"):
            left.unlink()
        compile_object([STAGE], target, tmp_path / "code.o", data, **options)
        return [path.read_bytes() for path in sorted(tmp_path.glob("code.*"))]

    return compile_one


def test_the_same_object_is_compiled_once(compile_one):
    assert compile_one() == compile_one() == [b"1"]
    assert compile_one("cortex-m7") == compile_one("cortex-m7") == [b"2", b"assembly"]
    assert compile_one(count=True) == [b"3"]
    assert compile_one() == [b"1"]


def test_other_data_and_sources_are_compiled_anew_and_the_old_object_goes(compile_one, tmp_path, monkeypatch):
    assert compile_one() == [b"1"]
    assert compile_one(data={"birthsim_image": np.arange(4)}) == compile_one(data={"birthsim_image": np.arange(4)}) == [b"2"]
    monkeypatch.setattr(compiler, "source_stamp", lambda path: f"another {path.name}")
    assert compile_one(data={"birthsim_image": np.arange(4)}) == [b"3"]
    assert len(list((tmp_path / "kept").iterdir())) == 1


def test_a_damaged_object_and_no_folder_cost_a_compilation(compile_one, tmp_path, monkeypatch):
    assert compile_one() == [b"1"]
    (path,) = (tmp_path / "kept").iterdir()
    path.write_bytes(path.read_bytes()[:-1])
    assert compile_one() == compile_one() == [b"2"]
    monkeypatch.setattr(compiler, "cache_folder", lambda: None)
    assert (compile_one(), compile_one()) == ([b"3"], [b"4"])
