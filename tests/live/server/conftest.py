"""A live server for the tests of this folder."""

import pytest
from starlette.testclient import TestClient

from birthsim_env import Parameters
from birthsim_live.server.app import create_app

HERE = "http://127.0.0.1:8000"


@pytest.fixture(scope="session")
def app(page):
    """The application, with controllers that run in Python and other options."""
    return lambda *controllers, **options: create_app(page, Parameters(), controllers, **options)


@pytest.fixture
def live(app):
    with TestClient(app("shut-valves"), base_url=HERE) as one:
        yield one
