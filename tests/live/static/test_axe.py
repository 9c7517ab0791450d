"""axe-core finds nothing on the page without a server."""

from __future__ import annotations

import os

import pytest

from tests.live import axe
from tests.live.axe import violations
from tests.live.browser import Window
from tests.live.static.lack import lack

LACK = lack()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(LACK) and os.environ.get("CI") != "true", reason=LACK), axe.NEEDED]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_nothing_is_found(chromium, address, theme):
    with Window(chromium, f"{address}?compare=backstepping") as window:
        window.page.emulate_media(color_scheme=theme)
        window.page.locator("#open-physics").click()
        window.wait("document.body.dataset.rigs === '2'")
        assert violations(window.page) == []
