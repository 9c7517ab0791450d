"""Kernels of every kind of argument; ``python -m tests.build.kernels.own OUT WORK [reversed] [every]`` builds them."""

import sys
from pathlib import Path

import numpy as np

from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.records import Rows, row, rows


class Pair(Rows):
    """Two groups of rows."""

    first = row("1", "one row")
    others = rows(2, "1", "two rows")


@helper
def _doubled(x):
    return 2.0 * x


@kernel
def numbers(whole, real, is_added, word):
    return real + whole if is_added else _doubled(real) + word


@kernel
def counted(first, second):
    return 10 * first + second


@kernel
def is_large(number):
    return number > 100.0


@kernel
def summed(array, result):
    """Over whatever order and strides, with an array of its own."""
    space = np.empty(array.shape[0])
    for i in range(array.shape[0]):
        space[i] = 0.0
        for k in range(array.shape[1]):
            space[i] += array[i, k]
    for i in range(array.shape[0]):
        result[i] = space[i]


@kernel
def named(pair, result):
    for i in range(pair.first.shape[0]):
        result[i] = pair.first[i] + pair.others[0, i] * pair.others[1, i]


LAYOUT = f"{Pair.__module__}.{Pair.__qualname__}"
KINDS = [
    *((numbers, "i d b u"), (counted, "i i"), (is_large, "d"), (named, f"{LAYOUT}:d2C d1C")),
    *((summed, f"{array} d1C") for array in ("d2C", "d2F", "d2A", "d2Cr", "f2C")),
]


def main(out, work, *how):
    from birthsim_build.kernels.building import made, write
    from birthsim_build.kernels.libraries import LIBRARIES, SHIPPED
    from birthsim_build.kernels.wanted import Wanted
    from birthsim_env.files import make_folder

    wanted = [Wanted(one, tuple(kinds.split())) for one, kinds in KINDS]
    libraries = list(LIBRARIES) if "every" in how else SHIPPED
    found = {one.wanted.key: one for one in made(wanted[::-1] if "reversed" in how else wanted, libraries, work)}
    write(make_folder(out), [found[key] for key in sorted(found)], libraries)


if __name__ == "__main__":
    from tests.build.kernels import own  # whose kernels have the module's name

    own.main(Path(sys.argv[1]), Path(sys.argv[2]), *sys.argv[3:])
