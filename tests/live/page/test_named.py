"""What the page says of what it shows: controllers by name, one number for one quantity, words that cover nothing."""

from itertools import pairwise

import pytest

from birthsim_live.rig.folder import PAGE
from tests.live.browser import Window

LAPTOP, PHONE = {"width": 1366, "height": 768}, {"width": 390, "height": 844}
NOTICE = "document.querySelector('#notices').textContent"
COVERED = """() => {
    const box = document.querySelector("#notices").getBoundingClientRect();
    const all = [...document.querySelectorAll("button, select, input, .switch label, progress, dd")];
    return all.filter((one) => one.checkVisibility()).filter((one) => {
        const own = one.getBoundingClientRect();
        return own.width && own.left < box.right && own.right > box.left && own.top < box.bottom && own.bottom > box.top;
    }).map((one) => one.outerHTML.slice(0, 80));
}"""


@pytest.mark.parametrize("size", [LAPTOP, PHONE])
def test_a_controller_that_is_none_is_asked_for_and_nothing_is_covered(chromium, server, size):
    with Window(chromium, f"{server.url}?controller=backsteping&friction=0.5", size, lab=False) as window:
        window.wait(f"{NOTICE}.includes('did you mean \"backstepping\"?')")
        window.wait("birthsim.settings.friction === 0.5")  # what is right beside it holds
        assert window.page.evaluate(COVERED) == []
        assert window.value("document.querySelector('#notices').getBoundingClientRect().bottom <= innerHeight")


@pytest.mark.parametrize("size", [LAPTOP, PHONE])
def test_any_controller_stands_in_the_switch_and_in_what_is_saved(chromium, server, size):
    with Window(chromium, f"{server.url}?controller=admittance-adaptive", size, lab=False) as window:
        window.wait("birthsim.settings.controller === 'admittance-adaptive'")
        pressed = "document.querySelector('.switch :checked + span')?.textContent"
        window.wait(f"{pressed} === 'admittance adaptive'")
        inside = "(([box, edge]) => box.right <= innerWidth && box.width > 20)"
        assert window.value(f"{inside}([document.querySelector('.switch :checked + span').getBoundingClientRect()])")
        window.page.evaluate("""() => {
            window.written = [];
            const own = CanvasRenderingContext2D.prototype.fillText;
            CanvasRenderingContext2D.prototype.fillText = function (words, ...place) {
                window.written.push(words);
                own.call(this, words, ...place);
            };
        }""")
        window.page.locator("[popovertarget=files]").click()
        with window.page.expect_download():
            window.page.locator("#save-png").click()
        assert window.page.evaluate("() => window.written.filter((words) => words.includes('admittance adaptive')).length")
        window.page.locator("[name=under]").nth(0).check(force=True)
        window.wait(f'{pressed} === "Paper\'s controller"')
        window.page.locator("#choose-other").click()  # and back
        window.wait("birthsim.settings.controller === 'admittance-adaptive'")


def test_the_arrow_has_the_number_of_the_strip(chromium, server):
    """Pulls of 175 N come and go by 70 N/s: the force of an instant is not that of a quarter of a second."""
    asked = "?scenario=forceps&controller=admittance-backstepping&scenario_force=true"
    with Window(chromium, server.url + asked, LAPTOP, lab=False) as window:
        window.page.evaluate("""() => {
            const scene = window.birthsim.scenes[0];
            const own = scene.drawForce;
            const digits = document.querySelector("[data-figure='user force'] dd span");
            const strip = () => digits.textContent.replaceAll("\\u2212", "-");
            window.pairs = [];
            let last = null;
            scene.drawForce = function (...given) {
                // The strip is written after the picture: it belongs to the picture before.
                if (last) window.pairs.push([last, strip()]);
                const label = own.apply(this, given);
                last = label?.words ?? null;
                return label;
            };
        }""")
        window.wait(
            "window.pairs.filter(([words]) => Number.parseFloat(words) > 20 && Number.parseFloat(words) < 170).length > 10"
        )
        for words, strip in window.page.evaluate("() => window.pairs"):
            written = sum(float(part) ** 2 for part in strip.split()) ** 0.5
            assert float(words.split()[0]) == pytest.approx(written, abs=0.6), (words, strip)


def test_words_in_the_lens_stay_inside_it(chromium, server):
    with Window(chromium, server.url, LAPTOP, lab=False) as window:
        found = window.page.evaluate("""async () => {
            const { Magnifier } = await import(new URL("magnifier.js", location));
            const { widthOf } = await import(new URL("pen.js", location));
            const canvas = document.createElement("canvas");
            document.body.append(canvas);
            const place = { target: [0, 0], compliant: [0, 0], position: [0, 0] };
            const found = [];
            for (const width of [104, 120, 135, 180, 240, 342, 400]) {
                Object.assign(canvas.style, { width: `${width}px`, height: `${width}px` });
                const lens = new Magnifier(canvas, document.createElement("p"));
                lens.sheet.fit();
                for (const error of [0.01, 44.43, 123.45, NaN]) {
                    for (const second of [null, place]) {
                        const { lines, foot } = lens.errorsOf({ ...place, second }, [{ error_mm: error }, { error_mm: error }]);
                        const boxes = lines.filter(({ words }) => words).map(({ words, y, size }) => ({
                            half: widthOf(words, { weight: 700, size }) / 2, top: y - 0.6 * size, foot: y + 0.6 * size, words,
                        }));
                        found.push({ width, error: String(error), two: Boolean(second), foot, boxes });
                    }
                }
            }
            canvas.remove();
            return found;
        }""")
    assert len(found) == 56
    for one in found:
        radius, boxes = one["width"] / 2, one["boxes"]
        for box in boxes:
            assert box["half"] ** 2 + (radius - box["top"]) ** 2 <= radius**2, one
            assert box["foot"] < 0.45 * one["width"], one
            assert "NaN" not in box["words"]
        assert all(above["foot"] <= below["top"] + 1 for above, below in pairwise(boxes)), one


def test_on_a_phone_two_rigs_are_named_in_their_order(chromium, server):
    asked = "?controller=admittance-backstepping&compare=backstepping"
    for lab in (False, True):
        with Window(chromium, server.url + asked, PHONE, lab=lab) as window:
            window.wait("birthsim.frame.second !== null && birthsim.frame.time > 0.2")
            top = "document.querySelectorAll('.rigs figcaption')[{}].getBoundingClientRect().bottom"
            assert window.value(f"{top.format(0)} < {top.format(1)}")
            assert window.value(f"{top.format(1)} <= document.querySelector('#rig').getBoundingClientRect().top + 1")
            window.hold(across=25)
            window.wait("birthsim.frame.drag_force[0] > 5")
            window.page.mouse.up()


def test_without_a_rig_nothing_can_be_pressed_and_it_says_how_it_is_served(chromium):
    """From a disk a browser loads no modules."""
    page = chromium.new_page()
    page.goto((PAGE / "index.html").as_uri())
    banner = page.locator("#offline")
    banner.wait_for(state="visible")
    assert "python -m http.server" in banner.text_content()
    shown = """() => [...document.querySelectorAll("button, select, input, a[href]")]
        .filter((one) => one.checkVisibility({ visibilityProperty: true })).length"""
    assert page.evaluate(shown) == 0
    page.close()
