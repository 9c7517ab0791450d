"""A browser, a rig and a window on it, for the tests of the page."""

import os
from pathlib import Path

import pytest

from tests.live.browser import CALM, Server, Window


@pytest.fixture(scope="session")
def server():
    with Server("live") as running:
        yield running


@pytest.fixture
def window(chromium, server):
    """A window with a rig of its own."""
    with Window(chromium, server.url + CALM) as opened:
        opened.wait(f"birthsim.settings.controller === '{CALM.partition('=')[2]}'")
        yield opened


@pytest.fixture(scope="session")
def pictures(tmp_path_factory):
    """Folder for screenshots: BIRTHSIM_SCREENSHOTS, or one that pytest throws away."""
    folder = Path(os.environ.get("BIRTHSIM_SCREENSHOTS") or tmp_path_factory.mktemp("screenshots"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder
