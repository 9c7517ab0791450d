"""Tables in MATLAB files up to version 7: vectors, structures of them, signals with names, matrices with names beside them."""

import io
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from birthsim_env.physics.rig.values import in_line, problem, shown
from birthsim_env.registry import register
from birthsim_env.tables.cells import Cells
from birthsim_env.tables.mat_arrays import Foreign, variables_of
from birthsim_env.tables.table import Raw, Reading, Table, table_of

DEPTH = 5
"""Levels of structures in which vectors are looked for."""

NEWER = "is a MATLAB 7.3 file (HDF5), which is not read; allowed: one of save(..., '-v7')"


@register(reader=".mat", about="MATLAB up to version 7: vectors, structures, signals of Simulink and dSPACE.", order=4)
def read_mat(source: str, content: bytes, how: Reading) -> Table:
    """The table of a MATLAB file; a vector of another length than most is no column."""
    if content.startswith(b"MATLAB 7.3") or b"\x89HDF" in content[:1024]:
        raise ValueError(f"{source} {NEWER}")
    try:
        found = list(_columns(_variables(source, content, how)))
    except Exception as error:
        # Damage trips struct, zlib, NumPy and iterators in a dozen ways.
        raise ValueError(f"{source} cannot be read as MATLAB ({problem(error)}); allowed: one of save(..., '-v7')") from error
    return table_of(source, _equal(source, found))


def _variables(source: str, content: bytes, how: Reading) -> dict[str, Any]:
    if content[126:128] in (b"IM", b"MI"):
        return variables_of(content, how.most, lambda numbers: how.check_size(source, numbers))
    if 0 not in content[:4]:
        raise ValueError("it is of no version of MATLAB")
    from scipy.io import loadmat  # late: it would double the time of ``import birthsim_env``

    return {name: value for name, value in loadmat(io.BytesIO(content)).items() if not name.startswith("__")}  # version 4


def _columns(variables: dict[str, Any]) -> Iterator[Raw]:
    """Columns in variables or in the fields of a structure; texts that name the columns of a matrix are none."""
    found = [leaf for name, value in variables.items() for leaf in _leaves(name, value, DEPTH, "")]
    words = {place: texts for place, (_, value, _) in enumerate(found) if len(texts := _words(value)) > 1}
    taken = set[int]()
    for name, value, _ in found:
        if isinstance(value, np.ndarray) and value.dtype.kind in "fiubc" and value.ndim == 2 and min(value.shape) > 1:
            fits = [(place, axis) for place, texts in words.items() for axis in (0, 1) if value.shape[axis] == len(texts)]
            if len(fits) == 1:
                place, axis = fits[0]
                taken.add(place)
                yield from (_vector(word, one, "") for word, one in zip(words[place], np.moveaxis(value, axis, 0), strict=True))
            else:
                said = f"is a matrix of {value.shape[0]} x {value.shape[1]}"
                yield _unusable(name, f"{said}; allowed: vectors, or one cell array with the names of its columns")
    for place, (name, value, unit) in enumerate(found):
        if place not in taken:
            yield from _vectors(name, value, unit)


def _leaves(name: str, value: Any, depth: int, inside: str) -> Iterator[tuple[str, Any, str]]:
    """Name, array and unit of what may be columns; ``inside`` names the structures that they are in."""
    fields = value.dtype.names if isinstance(value, np.ndarray) else None
    if fields is None or depth == 0:
        yield f"{inside}{name}", value, ""
        return
    data = next((field for field in ("data", "values") if field in _lower(fields)), None)
    label = next((field for field in ("name", "label") if field in _lower(fields)), None)
    for one in value.ravel():
        if data is not None and label is not None:
            said = _words(one[_lower(fields)[label]])
            unit = _words(one[_lower(fields)["unit"]]) if "unit" in _lower(fields) else []
            yield said[0] if said else f"{inside}{name}", one[_lower(fields)[data]], unit[0] if unit else ""
            continue
        outer = f"{name}." if depth < DEPTH else ""
        for field in fields:
            yield from _leaves(field, one[field], depth - 1, f"{inside}{outer}")


def _lower(fields: tuple[str, ...]) -> dict[str, str]:
    return {field.lower(): field for field in fields}


def _words(value: Any) -> list[str]:
    """The texts in a cell array of texts or an array of letters; none where there is anything else."""
    if not isinstance(value, np.ndarray):
        return []
    if value.dtype.kind == "U":
        return [str(word).strip() for word in value.ravel()]
    if value.dtype == object:
        cells = [one for one in value.ravel() if isinstance(one, np.ndarray) and one.dtype.kind == "U" and one.size == 1]
        return [str(cell.ravel()[0]).strip() for cell in cells] if len(cells) == value.size else []
    return []


def _vectors(name: str, value: Any, unit: str) -> Iterator[Raw]:
    """The column of a vector; nothing of a matrix."""
    if not isinstance(value, np.ndarray):
        kind = value.kind if isinstance(value, Foreign) else shown(type(value).__name__)
        yield _unusable(name, f"is {kind}; allowed: full arrays of numbers")
        return
    words = _words(value)
    if words and value.dtype == object and max(value.shape) == value.size:
        cells = Cells()
        numbers = np.array([cells.read(word, row, f"row {row}") for row, word in enumerate(words)])
        yield Raw(name, numbers, unit, cells.fault, cells.is_clock)
    elif value.dtype.kind not in "fiubc":
        yield _unusable(name, "holds no numbers; allowed: vectors of numbers")
    elif value.ndim != 2 or min(value.shape) <= 1:
        yield _vector(name, value.ravel(), unit)


def _unusable(name: str, fault: str) -> Raw:
    return Raw(name, np.empty(0), fault=fault)


def _vector(name: str, values: Any, unit: str) -> Raw:
    if values.dtype.kind != "c":
        return Raw(name, values.astype(np.float64), unit)
    fault = "" if (values.imag == 0).all() else "is complex; allowed: real numbers"
    return Raw(name, values.real.astype(np.float64), unit, fault)


def _equal(source: str, found: list[Raw]) -> list[Raw]:
    """Columns of one length, the most frequent one of vectors; what has another is a fault."""
    lengths = Counter(len(one.values) for one in found if len(one.values) > 1)
    if not lengths:
        words = in_line("; ".join(f"{one.heading} {one.fault.partition('; allowed')[0]}".strip() for one in found))
        raise ValueError(
            f"{source} has no vectors, but: {words or 'nothing'}; allowed: vectors or structures of vectors of numbers"
        )
    length = max(lengths, key=lambda one: (lengths[one], one))
    missing = np.full(length, np.nan)
    return [
        one
        if len(one.values) == length
        else one._replace(values=missing, fault=one.fault or f"has {len(one.values)} values, others {length}; allowed: as many")
        for one in found
    ]
