"""A browser, a rig and a window on it, for the tests of the page."""

import pytest

from birthsim_env import Parameters
from birthsim_live.rig.folder import packed_page, write_page
from tests.live.browser import CALM, Server, Window


@pytest.fixture(scope="session")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("worker") / "page"
    write_page(folder, packed_page(Parameters()))
    return folder


@pytest.fixture(scope="session")
def server():
    with Server("live") as running:
        yield running


@pytest.fixture
def window(chromium, server):
    with Window(chromium, server.url + CALM) as opened:
        opened.wait(f"birthsim.settings.controller === '{CALM.partition('=')[2]}'")
        yield opened
