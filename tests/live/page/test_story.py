"""The page as a newcomer meets it: rig and lens large, one switch, one number for one quantity, a film and a frame to share."""

import pytest

from tests.live.browser import Window, displacement

LAPTOP = {"width": 1366, "height": 768}
SEEN = """['.settings', '#plots', '#speed', '.lens', '.switch', '#next', '.readouts'].map((place) =>
    document.querySelector(place).checkVisibility())"""
HEAD = "2 * birthsim.hello.geometry.head.radius * birthsim.scenes[0].pen.scale"
WRITTEN = "document.querySelector('[data-figure=error] dd span').textContent"
LENS = "Number(document.querySelector('#magnification').textContent.match(/\\d+/)[0])"


@pytest.fixture
def story(chromium, server):
    with Window(chromium, server.url, LAPTOP, lab=False) as opened:
        yield opened


def test_the_rig_comes_first_and_the_lab_unfolds(story):
    assert story.value(SEEN) == [False, False, False, True, True, True, True]
    assert story.value("document.documentElement.scrollHeight") <= LAPTOP["height"]
    assert story.value(HEAD) > 90
    story.wait(f"{LENS} >= 15")
    story.page.locator("#open-lab").click()
    assert story.value(SEEN) == [True, True, True, True, False, True, True]
    assert story.value("location.hash") == "#lab"
    story.page.locator("#open-lab").click()
    assert story.value(f"{SEEN}[1]") is False


def test_a_switch_calms_the_head_under_the_same_pull(story):
    story.hold(across=60)
    story.live(1.0)
    story.wait("birthsim.frame.error_mm > 1")
    before = story.frame()
    story.page.locator("[name=under]").nth(1).dispatch_event("click")  # the mouse holds the head
    story.wait("birthsim.settings.controller === 'admittance-backstepping'")
    after = story.settle(least=10)
    assert after["pointer"] == before["pointer"]
    assert after["error_mm"] < 0.1
    assert displacement(after)[0] > 0.01
    # What the paper's controller did is no longer in the plots.
    story.wait("birthsim.plots.shown.history.view('error').at(0) < 10 && birthsim.plots.shown.history.view('time')[0] > 1")
    # With 20 N the challenge counts, and after five seconds it is met.
    story.wait("document.querySelector('#challenge').textContent === 'done'")


def test_a_press_beside_the_head_shows_where_it_is(story):
    story.hold(across=10)
    story.page.mouse.up()
    story.wait("!birthsim.scenes[0].cue")
    x, y = story.end_effector()
    story.page.mouse.click(x - 300, y)
    story.wait("birthsim.scenes[0].cue && birthsim.frame.pointer === null")


def test_a_soft_spring_shows_more_room(story):
    near = story.value(HEAD)
    story.page.evaluate("birthsim.send({ type: 'set', settings: { Kclx: 500, Kcly: 500 } })")
    story.wait(f"{HEAD} < 0.9 * {near}")
    story.page.locator("#open-lab").click()
    story.page.locator("#stiffness-source").click()
    story.wait("birthsim.settings.stiffness_source === 'scenario' && birthsim.settings.Kclx === 2000")


def test_figures_are_means_of_a_quarter_of_a_second(story):
    found = story.page.evaluate("""async () => {
        const { Means } = await import(new URL("means.js", location));
        const means = new Means();
        const [position, target, compliant] = [[0, 0], [0, 0], [0, 0]];
        const frame = (time, x) => ({ time, force: [x, 0], position, target, compliant, error_mm: x, second: null });
        const found = [];
        const push = (time, x, now) => {
            means.push(frame(time, x), now);
            found.push(means.shown[0].error_mm);
        };
        push(0, 1, 0);
        for (let k = 1; k <= 10; k += 1) push(0.025 * k, k, 25 * k);
        push(0.25, 7, 260); // time stands still
        push(0.1, 4, 261); // and runs back
        return found;
    }""")
    assert found == [1] * 10 + [5.5, 7, 4]


def test_one_quantity_has_one_number(chromium, server):
    address = f"{server.url}?controller=admittance-backstepping&compare=backstepping"
    with Window(chromium, address, LAPTOP, lab=False) as window:
        window.wait("birthsim.frame.second !== null && birthsim.frame.time > 1")
        caption = "document.querySelectorAll('.rigs figcaption')[1].querySelector('i').textContent"
        window.page.locator("input[name=shown]").nth(1).check()
        window.wait(f"{WRITTEN} === {caption}")
        for _ in range(20):
            assert window.value(f"{WRITTEN} === {caption}")
            window.live(0.1)


def test_an_axis_spans_what_is_in_sight(story):
    found = story.page.evaluate("""async () => {
        const { History } = await import(new URL("history.js", location));
        const { birthsim } = window;
        const plot = birthsim.plots.plots.find(({ definition: { title } }) => title === "error");
        const names = Object.keys(birthsim.plots.shown.history.columns).filter((name) => name !== "time");
        const history = new History(names, 512, 0.025);
        for (let k = 0; k < 500; k += 1) history.push(0.025 * k, { error: k < 10 ? 100 : 1 });
        birthsim.plots.show(history);
        return plot.valueRange();
    }""")
    assert found[1] < 10


def test_embedded_it_is_the_rig_its_lens_and_its_switch(chromium, server):
    with Window(chromium, f"{server.url}?embed=1&friction=0.5", {"width": 740, "height": 430}, lab=False) as window:
        window.wait("birthsim.settings.friction === 0.5")
        places = "['.transport', '.guide', '.readouts', '.lens', '.switch']"
        seen = f"{places}.map((one) => document.querySelector(one).checkVisibility())"
        assert window.value(seen) == [False, False, False, True, True]
        size = "[document.documentElement.scrollHeight, document.documentElement.scrollWidth]"
        assert window.value(size) == [430, 740]
        window.page.locator("[name=under]").nth(1).check(force=True)
        window.wait("location.search.includes('embed=1') && location.search.includes('admittance')")


def test_five_seconds_are_saved_as_a_film(story):
    size = story.page.evaluate("""async () => {
        const { filmOf } = await import(new URL("film.js", location));
        let [film, long] = [null, 500]; // a busy machine needs longer for the first picture
        do film = await filmOf(document.querySelector(".view"), long);
        while (film.size < 5000 && (long *= 2) < 60e3);
        const head = new Uint8Array(await film.slice(0, 4).arrayBuffer());
        return [film.size, ...head];
    }""")
    assert size[0] > 5000
    assert size[1:] == [0x1A, 0x45, 0xDF, 0xA3]  # of Matroska, which WebM is


def test_a_slow_machine_goes_over_to_slow_motion_once_unless_a_person_chose(story):
    found = story.page.evaluate("""async () => {
        const { Transport } = await import(new URL("transport.js", location));
        const sent = [];
        const said = [];
        const one = new Transport((message) => sent.push(message), () => "", (words) => said.push(words));
        const shares = [[0.6, 0], [0.6, 1000], [0.99, 1500], [0.01, 1600], [0.01, 3700], [0.6, 3800], [0.6, 9000]];
        for (const [share, now] of shares) {
            one.keepUp({ real_time: share }, now);
        }
        return [sent, said.length];
    }""")
    assert found == [[{"type": "speed", "speed": 0.5}], 1]


def test_the_stick_of_a_gamepad_pushes(story):
    """A stub stands for the gamepad: no browser has one without hands."""
    story.page.evaluate("""() => {
        window.stick = [0.5, -0.25, 0, 0];
        Object.defineProperty(navigator, "getGamepads", { value: () => [null, { axes: window.stick }] });
    }""")
    story.wait("Math.abs(birthsim.frame.force[0] - 30) < 1e-9 && Math.abs(birthsim.frame.force[1] - 15) < 1e-9")
    story.page.evaluate("() => { window.stick = [0.05, 0, 0, 0]; }")
    story.wait("birthsim.frame.pointer === null")
