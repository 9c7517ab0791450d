"""Examples of docstrings run."""

import doctest
from importlib import import_module

import pytest

MODULES = ("birthsim_drive.driver", "birthsim_drive.pace", "birthsim_drive.loop.record")


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name):
    found = doctest.testmod(import_module(name))
    assert found.attempted > 0
    assert found.failed == 0
