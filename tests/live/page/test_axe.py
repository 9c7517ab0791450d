"""axe-core finds nothing on the page, whatever it shows, by day and by night."""

import pytest

from tests.live import axe
from tests.live.axe import violations
from tests.live.browser import NARROW, WIDE, Server, Window
from tests.live.recordings.made import example, write_recording

pytestmark = axe.NEEDED


def test_a_picture_without_a_name_is_found(chromium):
    page = chromium.new_page()
    page.set_content('<!doctype html><html lang="en"><title>A</title><main><h1>A</h1><img src="data:,"></main>')
    assert [line.partition(":")[0] for line in violations(page)] == ["image-alt"]
    page.close()


SLOW = [pytest.param(*one, marks=pytest.mark.slow) for one in (("dark", WIDE), ("light", NARROW))]


@pytest.mark.parametrize(("theme", "size"), [("light", WIDE), *SLOW])
def test_nothing_is_found_on_the_page(chromium, server, theme, size):
    with Window(chromium, server.url, size) as window:
        page = window.page
        page.emulate_media(color_scheme=theme)
        window.live(0.2)
        assert violations(page) == []
        page.locator("#open-physics").click()
        window.choose(compare="lqr")
        window.wait("document.body.dataset.rigs === '2'")
        assert violations(page) == []
        for opens in ("[popovertarget=files]", ".term >> nth=0", "#open-about"):
            page.locator(opens).click()
            assert violations(page) == []
            page.keyboard.press("Escape")
        window.choose(compare="nothing")
        page.evaluate("window.birthsim.send({ type: 'set', settings: { mass: 900 } })")
        window.wait("document.querySelector('#notices').textContent.includes('mass = 900')")
        assert violations(page) == []


@pytest.mark.slow
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("asked", ["", "?embed=1", "?compare=pid"])
def test_nothing_is_found_on_the_story(chromium, server, theme, asked):
    with Window(chromium, server.url + asked, lab=False) as window:
        window.page.emulate_media(color_scheme=theme)
        window.live(0.2)
        assert violations(window.page) == []


@pytest.mark.parametrize("theme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
def test_nothing_is_found_on_a_replay(chromium, tmp_path, theme):
    write_recording(tmp_path / "rest.rec", example(100))
    with Server("live", "--replay", tmp_path / "rest.rec") as server, Window(chromium, server.url) as viewer:
        viewer.page.emulate_media(color_scheme=theme)
        assert violations(viewer.page) == []
