"""What kernels and their callers know of layouts; Numba is imported when it first asks for the type of one."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Layouts(type):
    """Type of the layouts, by which Numba knows them."""


class Named(metaclass=Layouts):
    """An array, ``rows``, whose layout is its class."""

    __slots__ = ("rows",)
    rows: NDArray[np.float64]

    @property
    def _numba_type_(self) -> Any:
        from birthsim_env.physics.compiled.record_types import type_of_record  # late: prebuilt code needs none of it

        return type_of_record(self)
