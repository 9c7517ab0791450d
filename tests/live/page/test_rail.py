"""The page of a rig with one cylinder: it shows and asks for nothing of another, and a hand is felt along the rail."""

import math

import pytest

from birthsim_env import Parameters
from birthsim_live.rig.folder import packed_page, write_page
from tests.live.browser import CALM, Server, Window, served

INCLINATION = 0.5
RAIL = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": INCLINATION})
OPEN = "[...document.querySelector('#guide').options].filter((one) => !one.disabled).map((one) => one.value)"
KEYS = "[...document.querySelectorAll('.key')].filter((one) => !one.hidden).map((one) => one.dataset.curve)"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("rail") / "page"
    write_page(place, packed_page(RAIL))
    return place


@pytest.fixture
def on_rail(chromium, folder):
    with served(folder) as url, Window(chromium, url + CALM) as opened:
        opened.wait(f"birthsim.settings.controller === '{CALM.partition('=')[2]}'")
        yield opened


def test_a_hand_pulls_along_the_rail_alone(on_rail):
    on_rail.hold(across=60)
    end = on_rail.settle(least=5.0)
    (fx, fy), (x, y), target = end["force"], end["position"], end["target"]
    assert math.atan2(fy, fx) == pytest.approx(INCLINATION, abs=1e-9)
    assert math.atan2(y - target[1], x - target[0]) == pytest.approx(INCLINATION, abs=1e-6)
    assert end["rendered"] == pytest.approx(end["stiffness"], rel=0.02)
    # The pointer stands beside the rail: its spring pulls harder than what is felt.
    pulled = [1000.0 * (far - near) for far, near in zip(end["pointer"], end["position"], strict=True)]
    assert math.hypot(*pulled) > 1.05 * math.hypot(fx, fy)


def test_nothing_is_shown_or_asked_of_a_cylinder_that_is_not_there(on_rail):
    assert on_rail.value("[...document.querySelectorAll('#settings .number input')].map((one) => one.name)") == [
        *("Kclx", "Kpneu2", "damping", "mass", "friction", "drag_stiffness"),
    ]
    keys = on_rail.value(KEYS)
    assert {"P2", "N2", "pneumatic_2"} <= set(keys)
    assert not {"P1", "N1", "pneumatic_1"} & set(keys)
    assert on_rail.value(OPEN) == ["Feel the friction", "Halve the stiffness", "What the force sensor buys"]
    slider = on_rail.page.locator("#set-Kclx")
    slider.focus()
    slider.press("ArrowRight")
    on_rail.wait("birthsim.settings.stiffness_source === 'sliders' && birthsim.settings.Kclx > 1000")
    now = on_rail.value("birthsim.settings")
    assert now["Kcly"] == now["Kclx"]


@pytest.mark.slow
def test_its_recording_plays_there_and_by_the_command_and_on_no_other_rig(on_rail, chromium, server, tmp_path):
    tab, file = on_rail.page, tmp_path / "rail.rec"
    tab.locator("#record").click()
    on_rail.wait("birthsim.state.recording !== null")
    on_rail.live(0.5)
    tab.locator("#record").click()
    on_rail.wait("birthsim.state.recording === null && birthsim.state.last_recording !== null")
    with tab.expect_download() as download:
        tab.locator("#download").click()
    download.value.save_as(file)
    on_rail.play(file)
    with Server("live --replay", file) as replaying, Window(chromium, replaying.url) as window:
        window.wait("birthsim.hello.mode === 'replay' && birthsim.frame.linkage !== null")
        assert window.value("birthsim.hello.cylinders") == [1]
        assert not {"P1", "N1"} & set(window.value(KEYS))
    with Window(chromium, server.url) as window:
        window.page.locator("#choose").set_input_files(file)
        window.wait("document.querySelector('#notices').textContent.includes('another shape')")
