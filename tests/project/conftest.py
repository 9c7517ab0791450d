from importlib import import_module

import pytest

from tests.console import ROOT


@pytest.fixture(scope="session")
def generated():
    def module(name):
        with pytest.MonkeyPatch.context() as patch:
            patch.syspath_prepend(ROOT / "docs")
            return import_module(f"_generate{name}")

    return module
