"""A controller that learns in the page: its error falls before one's eyes, the rig runs it, and then it can be pulled."""

import pytest

from tests.live import axe
from tests.live.axe import violations
from tests.live.browser import NARROW, Window

LESSON = "Learn it here"
LEARNS = "birthsim.settings.controller === 'learning'"
BUTTON = "document.querySelector('#learn').textContent"
SHOWN = "document.querySelector('#learning').checkVisibility()"


def opened(chromium, server, **options):
    window = Window(chromium, server.url, lab=False, **options)
    assert not window.value(SHOWN)
    window.page.locator("#guide").select_option(LESSON)
    window.wait(f"{LEARNS} && {SHOWN}")
    return window


def test_the_error_falls_and_the_rig_runs_what_is_known(chromium, server):
    with opened(chromium, server) as window:
        window.wait("birthsim.frame.error_mm > 20")  # its valves are shut, and the hand pushes
        assert window.value(BUTTON) == LESSON
        window.page.locator("#learn").click()
        window.wait("birthsim.learning.last() < 4")
        window.wait("birthsim.frame.error_mm < 8 && birthsim.frame.lost === null")
        window.page.locator("#learn").click()
        window.wait(f"{BUTTON} === 'Go on'")
        known = window.value("birthsim.learning.errors.length")
        # Under the paper's controller nobody looks on; the switch leads back.
        window.page.locator("[name=under]").nth(0).check(force=True)
        window.wait(f"birthsim.settings.controller === 'backstepping' && !{SHOWN}")
        window.page.locator("[name=under]").nth(2).check(force=True)
        window.wait(f"{LEARNS} && {SHOWN}")
        window.page.locator("#learn").click()
        window.wait(f"birthsim.learning.errors.length > {known}")


def test_it_rests_while_nobody_looks(chromium, server):
    with opened(chromium, server) as window:
        told = window.page.evaluate("""() => {
            const { learning } = window.birthsim;
            const told = [];
            learning.worker = { postMessage: ({ on }) => told.push(on) };
            document.querySelector("#learn").click();
            Object.defineProperty(document, "hidden", { value: true, configurable: true });
            document.dispatchEvent(new Event("visibilitychange"));
            delete document.hidden;
            document.dispatchEvent(new Event("visibilitychange"));
            return told;
        }""")
        assert told == [True, False, True]


def test_what_is_missing_is_named(chromium, server):
    with opened(chromium, server) as window:
        window.page.route("**/learn.bin", lambda route: route.fulfill(status=404))
        window.page.locator("#learn").click()
        window.wait("document.querySelector('#notices').textContent.includes('learn.bin is missing (404)')")
        assert window.value(BUTTON) == LESSON
        window.complaints.clear()  # of the browser, about the file


@axe.NEEDED
@pytest.mark.parametrize("theme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
def test_nothing_moves_and_axe_finds_nothing(chromium, server, theme):
    with opened(chromium, server, size=NARROW, touch=True) as window:
        window.page.emulate_media(color_scheme=theme)
        places = "['.view', '.under', '#learned', '.legend', '#readouts'].map((one) => document.querySelector(one))"
        # Below the bar, which takes another line where a busy machine tells how far physics is behind.
        places += ".map((one) => one.getBoundingClientRect().y - document.querySelector('.bar').getBoundingClientRect().bottom)"
        before = window.value(places)
        window.page.locator("#learn").tap()
        window.wait("birthsim.learning.errors.length > 0")
        assert window.value(places) == before
        assert window.value("document.documentElement.scrollWidth") <= NARROW["width"]
        assert violations(window.page) == []


@pytest.mark.slow
@pytest.mark.weekly
def test_learned_to_the_end_it_gives_way_as_a_spring(chromium, server):
    with opened(chromium, server) as window:
        window.page.locator("#learn").click()
        window.wait(f"{BUTTON} === 'Pull it yourself'", seconds=600.0)
        assert window.value("birthsim.learning.last()") < 1.0
        window.page.locator("#learn").click()
        window.wait(f"birthsim.settings.scenario === 'probe' && {LEARNS}")
        window.live(2.0)
        window.hold(across=60)
        assert window.settle(least=10)["error_mm"] < 1.5
