"""Variables of MATLAB files as SciPy reads them; damage that ends SciPy's process is an error here."""

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from baselines.logs.table import read_table
from birthsim_env.tables.mat_arrays import Foreign, variables_of
from birthsim_env.tables.table import Reading

CONTENT: dict[str, Any] = {
    "row": np.arange(4.0),
    "matrix": np.arange(6.0).reshape(2, 3),
    "cube": np.arange(24.0).reshape(2, 3, 4),
    "small": np.array([1, -2], dtype=np.int8),
    "wide": np.array([2**40], dtype=np.int64),
    "single": np.array([0.5, 1.5], dtype=np.float32),
    "flag": np.array([True, False]),
    "complex": np.array([1 + 2j, 3]),
    "scalar": 2.5,
    "nothing": np.empty((0, 3)),
    "word": "hällo",
    "words": np.array(["one", "three"]),
    "cells": np.array(["a", 1.0, np.arange(3)], dtype=object),
    "structure": {"a": np.arange(3.0), "inner": {"b": "x", "c": 1}},
    "structures": np.array([(1.0, "a"), (2.0, "b")], dtype=[("value", object), ("name", object)]),
}


def saved(compressed: bool) -> bytes:
    file = io.BytesIO()
    savemat(file, CONTENT, do_compression=compressed)
    return file.getvalue()


def assert_same(found: Any, exact: Any) -> None:
    assert (found.shape, found.dtype.names) == (exact.shape, exact.dtype.names)
    if exact.dtype.names:
        for name in exact.dtype.names:
            assert_same(found[name], exact[name])
    elif exact.dtype == object:
        for one, other in zip(found.ravel(), exact.ravel(), strict=True):
            assert_same(one, other)
    else:
        np.testing.assert_array_equal(found, exact)


@pytest.mark.parametrize("compressed", [False, True])
def test_variables_are_those_that_scipy_reads(compressed: bool) -> None:
    content = saved(compressed)
    found, exact = variables_of(content, 2**20, lambda _: None), loadmat(io.BytesIO(content))
    assert list(found) == list(CONTENT)
    for name, value in found.items():
        assert_same(value, exact[name])


def test_damage_is_an_error_of_one_line(tmp_path: Path) -> None:
    content, rng = saved(False), np.random.default_rng(0)
    said = []
    for _ in range(300):
        damaged = bytearray(content)
        for place in rng.integers(128, len(content), size=3):
            damaged[place] ^= 1 << int(rng.integers(8))
        (tmp_path / "own.mat").write_bytes(damaged)
        try:
            read_table(tmp_path / "own.mat", Reading(most=2**20))
        except ValueError as error:
            said.append(str(error))
    assert 50 < len(said) < 300
    assert all(re.fullmatch("log = '.*own.mat' .*allowed: .*", line) for line in said)
    with pytest.raises(ValueError, match="holds more than 1000 bytes"):
        variables_of(content, 1000, lambda _: None)
    with pytest.raises(ValueError, match="it is cut"):
        variables_of(content[:-4], 2**20, lambda _: None)


def test_what_is_no_array_is_named() -> None:
    from scipy.sparse import csr_array

    file = io.BytesIO()
    savemat(file, {"sparse": csr_array(np.eye(3))})
    assert variables_of(file.getvalue(), 2**20, lambda _: None) == {"sparse": Foreign("a sparse matrix")}
