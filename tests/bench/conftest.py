"""What tests of pictures share."""

import pytest
from matplotlib import pyplot as plt

from lab.studies.comparison import figure, stiffness_figures


@pytest.fixture
def drawn(monkeypatch):
    """The figures drawn, by name, still open."""
    found = {}
    for module in (figure, stiffness_figures):
        monkeypatch.setattr(module, "save", lambda picture, folder, name: found.setdefault(name, picture) and [])
    yield found
    plt.close("all")
