"""Trainings that are over soon."""

import gymnasium
import pytest

from agents.training import trainer as training


@pytest.fixture
def short_probe(monkeypatch):
    """Episodes of a second, so that trainings whose result does not matter validate quickly."""
    make_vec = gymnasium.make_vec
    monkeypatch.setattr(training.gymnasium, "make_vec", lambda *args, **kwargs: make_vec(*args, **{"duration": 1.0, **kwargs}))
