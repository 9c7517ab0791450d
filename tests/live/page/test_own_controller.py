"""A controller of one's own under the page: Python commands, the browser's rig waits, and what goes wrong is shown."""

import pytest

from tests.live.browser import Server, Window
from tests.live.server.test_controller import OWN

LOST = "document.querySelector('#lost').textContent"


@pytest.fixture(scope="module")
def mine(tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "mine.py"
    path.write_text(OWN, encoding="utf-8")
    return path


def test_two_run_in_python_side_by_side_until_others_are_chosen(chromium, mine):
    options = ("--controller", f"{mine}:Law", "--compare", "shut-valves")
    with Server("live", *options) as server, Window(chromium, server.url) as window:
        window.wait("birthsim.settings.controller.endsWith('mine.py:Law') && birthsim.settings.compare === 'shut-valves'")
        window.wait("birthsim.frame.second?.time > 0.2 && birthsim.frame.time === birthsim.frame.second.time")
        assert window.value("document.querySelector('select[name=controller]').selectedOptions[0].text") == "mine.py:Law"
        window.page.locator("#reset").click()
        window.wait("birthsim.frame.time < 0.1")
        window.wait("birthsim.frame.time > 0.2")
        for name in ("pid", "slammed-valves", "backstepping"):
            window.choose(controller=name)
            window.wait("birthsim.frame.time > 0.2")
        assert window.frame()["lost"] is None


def test_what_goes_wrong_is_shown_and_a_reset_makes_it_anew(chromium, mine):
    with Server("live", "--controller", f"{mine}:Fails") as server, Window(chromium, server.url) as window:
        window.wait(f"{LOST}.includes('mine.py:Fails gives up: ZeroDivisionError: division by zero')")
        mine.write_text(OWN.replace("self.calls / 0", "None"))
        window.page.keyboard.press("r")
        window.wait("birthsim.frame.lost === null && birthsim.frame.time > 0.1")
        mine.write_text(OWN)


def test_a_slow_one_is_slow_motion_and_one_that_hangs_can_be_left(chromium, mine):
    options = ("--controller", f"{mine}:Slow", "--compare", f"{mine}:Hangs")
    with Server("live", *options) as server, Window(chromium, server.url) as window:
        window.wait("birthsim.settings.compare.endsWith('Hangs') && birthsim.frame.real_time === 0")
        window.choose(compare="nothing")
        window.wait("birthsim.frame.time > 0.02 && birthsim.frame.behind > 0.5")
        window.wait("/^physics at [0-6] % of real time/.test(document.querySelector('#status').textContent)")
        window.choose(controller="pid")
        window.wait("birthsim.frame.real_time > 0.5")


@pytest.mark.slow
def test_a_server_that_has_gone_is_told(chromium, mine):
    with Server("live", "--controller", f"{mine}:Law") as server:
        window = Window(chromium, server.url)
        window.wait("birthsim.frame.time > 0.1")
    window.wait(f"{LOST}.includes('Python has gone')")
    window.context.close()
