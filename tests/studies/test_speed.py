"""The speeds' study needs machine code that it can read, whatever code runs the kernels."""

import platform

import pytest

from lab.studies.speed.study import packed_fraction


@pytest.mark.slow
@pytest.mark.weekly
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 instruction names")
def test_the_integrators_divisions_and_roots_are_packed():
    packed, scalar = packed_fraction()
    assert packed >= 19  # 10 divisions and 9 roots of one right-hand side
    assert scalar <= 2 * packed
