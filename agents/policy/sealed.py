"""A safetensors file with JSON about its arrays and a SHA-256 of every byte: what has changed is refused, nothing can run."""

import hashlib
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from birthsim_env.physics.rig.json_reading import parse_json
from birthsim_env.physics.rig.values import shown

Arrays = dict[str, NDArray[Any]]

_KEY = "birthsim"
_BLANK = b"0" * 64
"""Stands where the checksum will, while it is computed."""


def sealed(arrays: Arrays, about: dict[str, Any]) -> bytes:
    """The content of a file with ``arrays`` and ``about``, which is JSON; the same arguments give the same bytes."""
    # One entry: safetensors writes several in no fixed order.
    text = json.dumps({"sha256": _BLANK.decode(), **about})
    content = save({name: np.asarray(array, order="C") for name, array in arrays.items()}, {_KEY: text})
    return content.replace(_BLANK, hashlib.sha256(content).hexdigest().encode(), 1)


def unsealed(content: bytes, form: str) -> tuple[Arrays, dict[str, Any]]:
    """The arrays in ``sealed(arrays, about)``, and ``about``, whose ``format`` must be ``form``.

    Raises ``ValueError`` that says what is wrong with a content that has changed, or is of another format.
    """
    size = int.from_bytes(content[:8], "little")
    try:
        header = parse_json("header", content[8 : 8 + size], {"__metadata__": {_KEY: str}})
        about = parse_json("header", header["__metadata__"][_KEY], {"sha256": str, "format": str}, finite=False)
    except ValueError as error:
        raise ValueError(f"no {form} or damaged") from error
    checksum, found = about.pop("sha256").encode(), about["format"]
    if hashlib.sha256(content.replace(checksum, _BLANK, 1)).hexdigest().encode() != checksum:
        raise ValueError("damaged: its checksum is of another content")
    if found != form:
        raise ValueError(f"of the foreign format {shown(found)}, not {form!r}")
    try:
        return load(content), about
    except SafetensorError as error:
        raise ValueError(f"damaged ({error})") from error
