"""A live server for the tests of this folder."""

import pytest
from starlette.testclient import TestClient

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.folder import packed_page, write_page
from birthsim_live.server.app import create_app

HERE = "http://127.0.0.1:8000"


@pytest.fixture(scope="session")
def app(tmp_path_factory):
    """The application, with controllers that run in Python and other options."""
    folder = tmp_path_factory.mktemp("served") / "page"
    write_page(folder, packed_page(Parameters()))
    return lambda *controllers, **options: create_app(folder, Parameters(), controllers, **options)


@pytest.fixture
def live(app):
    with TestClient(app("shut-valves"), base_url=HERE) as one:
        yield one
