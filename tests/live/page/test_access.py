"""The live page for everybody: keys, screen readers, high contrast, night, phones, slow motion; and frames without numbers."""

import numpy as np
import pytest

from birthsim_live.logs.recording import SLICES
from tests.live.browser import NARROW, Window
from tests.live.recordings.made import example, write_recording

DRAWN = """[...document.querySelectorAll('.plot canvas')].some((canvas) =>
    canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((value) => value > 0))"""
"""Only plots that can be seen are drawn."""
CUT = """[...document.querySelectorAll('label, button, figcaption, legend, dt, dd, .status, .hint, h1, .view p, .view b')]
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
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("select[name=controller]", "#set-friction")]


@pytest.mark.parametrize("place", ["#rig", *SLOW])
def test_r_resets_and_space_pauses_wherever_the_focus_is(window, place):
    target = window.page.locator(place)
    before = window.value("birthsim.settings")
    window.live(2.0)  # so long does what follows have to see that time began anew
    time = window.frame()["time"]
    target.press("r")
    window.wait(f"birthsim.frame.time < {time}")
    if not place.startswith("select"):
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


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_rig_is_painted_in_the_colours_of_the_theme(chromium, server, theme):
    with Window(chromium, server.url) as window:
        window.page.emulate_media(color_scheme=theme)
        corner = "document.querySelector('#rig').getContext('2d').getImageData(2, 2, 1, 1).data[0]"
        window.wait(f"{corner} {'>' if theme == 'light' else '<'} 128")


@pytest.mark.slow
def test_high_contrast_keeps_the_pictures_readable_and_the_sliders_visible(chromium, server):
    with Window(chromium, server.url) as window:
        window.page.emulate_media(forced_colors="active", color_scheme="dark")
        window.live(0.3)
        paper = window.value("getComputedStyle(document.documentElement).getPropertyValue('--paper').trim()")
        painted = "['.plot', '#gauges'].map((place) => getComputedStyle(document.querySelector(place)).backgroundColor)"
        assert window.value(painted) == [paper, paper]
        assert window.value("getComputedStyle(document.querySelector('#set-mass')).forcedColorAdjust") == "none"


SIZES = [
    *[("nothing", 320, 640), ("nothing", 1280, 800), ("pid", 320, 640)],
    *(pytest.param("nothing", *size, marks=pytest.mark.slow) for size in ((400, 800), (768, 1024), (1366, 768), (1920, 1080))),
    *(pytest.param("pid", *size, marks=pytest.mark.slow) for size in ((1280, 800), (768, 1024), (1366, 768))),
]


@pytest.mark.parametrize(("compare", "width", "height"), SIZES)
def test_a_window_of_any_size_shows_whole_words_and_scrolls_one_way(chromium, server, compare, width, height):
    with Window(chromium, f"{server.url}?compare={compare}", {"width": width, "height": height}) as window:
        window.wait(f"document.body.dataset.rigs === '{1 + (compare == 'pid')}'")
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
        rigs = "[...document.querySelectorAll('.rigs canvas')].map((one) => one.getBoundingClientRect().toJSON())"
        # On a phone the second head is an outline in the first's picture.
        shown = 1 + (compare == "pid" and width > 700)
        window.wait(f"{rigs}.filter((box) => box.width > 250 && box.height > 150).length === {shown}")
        boxes = [box for box in window.value(rigs) if box["width"]]
        assert len(boxes) == shown
        assert boxes[-1]["left"] >= boxes[0]["right"] or len(boxes) == 1


@pytest.mark.slow
def test_a_pointer_that_rests_keeps_its_hold_and_one_that_falls_silent_lets_go(window):
    window.hold(across=30)
    window.live(4.0)  # longer than the rig waits for a word
    window.wait("birthsim.frame.pointer !== null")
    window.page.mouse.up()
    window.wait("birthsim.frame.pointer === null")
    window.page.evaluate("birthsim.send({ type: 'drag', position: [0.53, 0], id: 1 })")
    window.wait("birthsim.frame.pointer !== null")
    window.wait("birthsim.frame.pointer === null")


@pytest.mark.slow
def test_frames_without_numbers_are_shown_as_such(window, tmp_path):
    rows = example(200)
    for name in ("joints", "position", "velocity", "pressures", "compliant"):
        rows[100:150, SLICES[name]] = np.nan
    write_recording(tmp_path / "lost.rec", rows)
    window.play(tmp_path / "lost.rec")
    window.pause()  # at its end a replay halts, and plays on from wherever it is put
    for time, shown in ((0.5, "–"), (0.1, "+0.0")):
        window.page.locator("#scrub").fill(str(time))
        window.wait(f"document.querySelector('[data-figure=displacement] dd').textContent.startsWith('{shown}')")


def test_on_a_phone_a_finger_drags_the_head_and_the_lab_below_it(chromium, server):
    with Window(chromium, server.url, NARROW, touch=True) as window:
        session = window.context.new_cdp_session(window.page)

        def touch(kind, *points):
            places = [{"x": x, "y": y} for x, y in points]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})

        x, y = window.end_effector()
        touch("touchStart", (x, y))
        for k in range(1, 6):
            touch("touchMove", (x - 4 * k, y + 8 * k))
        window.wait("birthsim.frame.force[1] < -10")
        assert window.value("scrollY") == 0
        touch("touchEnd")
        window.wait("birthsim.frame.pointer === null")
        sheet = "document.querySelector('#fold')"
        place = window.value("document.querySelector('#rig').getBoundingClientRect().top")
        touch("touchStart", (x, 760))
        for k in range(1, 9):
            touch("touchMove", (x, 760 - 15 * k))
        window.wait(f"{sheet}.scrollTop > 20")
        touch("touchEnd")
        assert window.value("document.querySelector('#rig').getBoundingClientRect().top") == place, "the rig stays"
        # The handle makes the sheet higher, by finger and by keys; a tap folds it away.
        handle = window.page.locator("#handle")
        box = handle.bounding_box()
        middle, top = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        touch("touchStart", (middle, top))
        for k in range(1, 6):
            touch("touchMove", (middle, top - 20 * k))
        touch("touchEnd")
        window.wait(f"Math.abs({sheet}.clientHeight - {0.42 * NARROW['height'] + 100}) < 3")
        handle.press("ArrowDown")
        window.wait(f"Math.abs({sheet}.clientHeight - {0.42 * NARROW['height'] + 40}) < 3")
        assert window.value("birthsim.frame.pointer") is None, "no key pushes the head"
        handle.tap()
        window.wait(f"{sheet}.clientHeight === 40")
        assert window.value("document.documentElement.scrollHeight") == NARROW["height"]


def test_slow_motion(window):
    for speed in ("0.1", "1"):
        window.page.locator("#speed").select_option(speed)
        window.wait(f"birthsim.state.speed === {speed}")
