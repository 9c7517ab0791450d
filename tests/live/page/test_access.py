"""The live page for everybody: keys, screen readers, high contrast, night, small windows; and frames without numbers."""

import sys
from urllib.request import urlopen

import numpy as np
import pytest

from birthsim_live.logs.recording import SLICES
from tests.live.browser import Server, Window
from tests.live.recordings.made import example, write_recording

DRAWN = """[...document.querySelectorAll('.plot canvas')].some((canvas) =>
    canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((value) => value > 0))"""
"""Only plots that can be seen are drawn."""
CUT = """[...document.querySelectorAll('label, button, figcaption, legend, dt, dd, .status, .hint, h1')]
    .filter((e) => e.offsetParent && e.scrollWidth > e.clientWidth + 1).map((e) => e.textContent)"""
CUT_CHOICES = """[...document.querySelectorAll('select')].filter((e) => e.offsetParent).filter((e) => {
    const pen = document.createElement('canvas').getContext('2d');
    const look = getComputedStyle(e);
    pen.font = look.font;
    const room = e.clientWidth - parseFloat(look.paddingLeft) - parseFloat(look.paddingRight) - 16;
    return [...e.options].some((o) => !o.disabled && pen.measureText(o.text).width > room);
}).map((e) => e.name || e.id)"""
"""Lists whose longest choice does not fit beside their arrow."""
SPOKEN = """() => {
    window.spoken = [];
    window.listening = performance.now();
    const live = 'output, [role=status], [role=alert], [role=log], [aria-live=polite], [aria-live=assertive]';
    const seen = (changes) => {
        for (const { target } of changes) {
            const element = target.nodeType === Node.TEXT_NODE ? target.parentElement : target;
            if (element?.closest(live)) window.spoken.push(element.closest(live).textContent);
        }
    };
    new MutationObserver(seen).observe(document.body, { childList: true, characterData: true, subtree: true });
}"""
CONTRASTS = """[...document.querySelectorAll('h1, label, legend, dt, dd, small, .status, .hint, .title, button:enabled')]
    .filter((e) => e.offsetParent).map((element) => {
    const channels = (text) => text.match(/[\\d.]+/g).map(Number);
    const luminance = (text) => {
        const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
        const [r, g, b] = channels(text).map((c) => linear(c / 255));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    let behind = element;
    while (behind && (channels(getComputedStyle(behind).backgroundColor)[3] ?? 1) === 0) behind = behind.parentElement;
    const of = [getComputedStyle(element).color, getComputedStyle(behind ?? document.body).backgroundColor].map(luminance);
    return [(Math.max(...of) + 0.05) / (Math.min(...of) + 0.05), element.textContent.trim()];
}).filter(([ratio]) => ratio < 4.5)"""
"""Texts whose contrast is less than WCAG's AA asks for."""


@pytest.mark.parametrize(
    "place",
    [
        "#rig",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("select[name=controller]", "#set-friction", "input[name=scenario_force]")
        ),
    ],
)
def test_r_resets_and_space_pauses_wherever_the_focus_is(window, place):
    target = window.page.locator(place)
    before = window.value("birthsim.settings")
    window.live(2.0)  # so long does what follows have to see that time began anew
    time = window.frame()["time"]
    target.press("r")
    window.wait(f"birthsim.frame.time < {time}")
    if place in ("#set-friction", "#rig"):
        target.press(" ")
        window.wait("birthsim.state.paused")
        target.press(" ")
        window.wait("!birthsim.state.paused")
    assert window.value("birthsim.settings") == before


@pytest.mark.slow
def test_a_screen_reader_is_told_what_matters_and_no_digits(window):
    window.page.evaluate(SPOKEN)
    window.hold(across=30)
    window.live(2.0)
    window.page.mouse.up()
    # How the machine keeps up is told every 10 s at most, on a busy one; the lesson besides, and what the drag changes.
    told = 3 + window.value("(performance.now() - window.listening) / 1e4")
    assert window.value("window.spoken.length") <= told, window.value("window.spoken")
    window.page.locator("body").press(" ")
    window.wait("window.spoken.at(-1) === 'paused'")
    window.page.locator("body").press(" ")
    window.wait("!birthsim.state.paused")


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_texts_have_contrast_and_the_rig_is_painted_in_the_colours_of_the_theme(chromium, server, pictures, theme):
    with Window(chromium, server.url) as window:
        window.page.emulate_media(color_scheme=theme)
        window.live(0.3)
        assert window.value(CONTRASTS) == []
        corner = "document.querySelector('#rig').getContext('2d').getImageData(2, 2, 1, 1).data[0]"
        window.wait(f"{corner} {'>' if theme == 'light' else '<'} 128")
        window.page.screenshot(path=pictures / f"theme_{theme}.png")


@pytest.mark.slow
def test_high_contrast_keeps_the_pictures_readable_and_the_sliders_visible(chromium, server, pictures):
    with Window(chromium, server.url) as window:
        window.page.emulate_media(forced_colors="active", color_scheme="dark")
        window.live(0.3)
        colours = window.value(
            "['.plot', '#gauges'].map((place) => getComputedStyle(document.querySelector(place)).backgroundColor)"
        )
        assert colours == [window.value("getComputedStyle(document.documentElement).getPropertyValue('--paper').trim()")] * 2
        assert window.value("getComputedStyle(document.querySelector('#set-mass')).forcedColorAdjust") == "none"
        window.page.screenshot(path=pictures / "forced.png")


@pytest.mark.parametrize(
    ("width", "height"),
    [
        (320, 640),
        (1280, 800),
        *(pytest.param(*size, marks=pytest.mark.slow) for size in ((400, 800), (768, 1024), (1366, 768), (1920, 1080))),
    ],
)
def test_a_window_of_any_size_shows_whole_words_and_scrolls_one_way(chromium, server, width, height):
    with Window(chromium, server.url, {"width": width, "height": height}) as window:
        assert window.value("document.documentElement.scrollWidth") <= width
        if width > 1080:
            assert window.value("document.documentElement.scrollHeight") <= height
            window.wait(DRAWN)
        assert window.value("document.querySelectorAll('#plots .plot canvas').length") == 6
        assert window.value(CUT) == []
        assert window.value(CUT_CHOICES) == []
        window.page.locator("#record").click()
        window.wait("birthsim.state.recording !== null && document.querySelector('#record').textContent.includes('Stop')")
        assert window.value(CUT) == []
        window.page.locator("#record").click()
        window.wait("birthsim.state.recording === null")


@pytest.mark.slow
def test_a_pointer_that_rests_keeps_its_hold(chromium, server):
    with Window(chromium, server.url) as window:
        window.hold(across=30)
        window.live(4.0)  # longer than the rig waits for a word
        window.wait("birthsim.frame.pointer !== null")
        window.page.mouse.up()


@pytest.mark.slow
def test_frames_without_numbers_are_shown_as_such(window, tmp_path):
    rows = example(200)
    for name in ("joints", "position", "velocity", "pressures", "compliant"):
        rows[100:150, SLICES[name]] = np.nan
    write_recording(tmp_path / "lost.rec", rows)
    window.page.locator("#choose").set_input_files(tmp_path / "lost.rec")
    window.wait("birthsim.hello.mode === 'replay'")
    # At its end a replay halts, and plays on from wherever it is put; paused, it stays there.
    window.page.evaluate("birthsim.send({ type: 'pause', paused: true })")
    window.wait("birthsim.state.paused")
    for time, shown in ((0.5, "–"), (0.1, "+0.0")):
        window.page.locator("#scrub").fill(str(time))
        window.wait(f"document.querySelector('[data-figure=displacement] dd').textContent.startsWith('{shown}')")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has all of 127.0.0.0/8")
def test_the_address_that_is_printed_is_served():
    with Server("live", "--host", "127.0.0.2") as server:
        assert server.url.startswith("http://127.0.0.2:")
        with urlopen(server.url) as answer:
            assert answer.status == 200
