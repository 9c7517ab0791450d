"""What the page makes visible: the error, the physics behind the force, and what its words mean."""

import csv
import io
import math
import struct

import pytest

from birthsim_env.physics.linkage.mechanics import piston_force
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.words import FIGURES, PAPER


def test_the_running_error_is_the_root_mean_square_of_two_seconds(window):
    found = window.page.evaluate("""async () => {
        const { RunningRms } = await import(new URL("rms.js", location));
        const rms = new RunningRms();
        const found = [];
        let time = 0;
        for (let k = 0; time < 5; k += 1) {
            time += 0.01 + 0.02 * (k % 2);
            found.push(rms.push(time, 2 * Math.sin(2 * Math.PI * 2 * time)));
        }
        return [found.at(-1), rms.push(0.1, 3), rms.push(0.1, NaN)];
    }""")
    assert found[0] == pytest.approx(math.sqrt(2), rel=0.02)
    assert found[1:] == [3, 3]


def test_the_hands_work_is_force_along_the_way(window):
    """A spring stores k x^2 / 2 and gives it back; a leap of time, by a reset or a search, begins anew."""
    found = window.page.evaluate("""async () => {
        const { Work } = await import(new URL("physics/work.js", location));
        const work = new Work();
        const found = [];
        const frame = (time, x) => {
            const position = [x, 0];
            return { time, position, force: [2000 * x, 0], velocity: [0.1, 0], target: [0, 0], compliant: position };
        };
        for (let k = 0; k <= 100; k += 1) {
            work.push(frame(0.02 * k, 4e-4 * Math.min(k, 100 - k)));
            if (k === 50) found.push(work.figures(frame(1, 0.02)));
        }
        found.push(work.done);
        work.push(frame(9, 0.02));
        return [...found, work.done];
    }""")
    assert found[0] == pytest.approx({"power": 4.0, "work": 0.4, "stored": 0.4, "rest": 0.0})
    assert found[1:] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_the_force_of_the_air_is_that_of_the_model(window):
    rig = Parameters()
    found = window.page.evaluate("""async () => {
        const { airForces } = await import(new URL("physics/forces.js", location));
        const { areas, air } = window.birthsim.hello;
        return airForces([5.1e5, 2.2e5, 3.3e5, 4.4e5], areas, air.atmosphere);
    }""")
    for force, pressures, one in zip(found, ((5.1e5, 2.2e5), (3.3e5, 4.4e5)), (rig.cylinder1, rig.cylinder2), strict=True):
        wanted = piston_force(*pressures, one.area_p, one.area_n, rig.air.atmospheric_pressure)
        assert force == pytest.approx(wanted, rel=1e-12)


def test_the_physics_open_and_close_and_tell_of_a_pull(window):
    panel, button = window.page.locator("#physics"), window.page.locator("#open-physics")
    assert not panel.is_visible()
    button.click()
    assert button.get_attribute("aria-expanded") == "true"
    window.hold(across=60)
    frame = window.settle(least=10)
    stored = sum(f * f / k for f, k in zip(frame["force"], frame["stiffness"], strict=True)) / 2
    digits = "[...document.querySelectorAll('#physics dd span')].map((e) => Number(e.textContent.replace('\u2212', '-')))"
    window.wait(f"Math.abs(({digits})[2] - {stored}) < 0.02 && Math.abs(({digits})[0]) < 0.02")
    _, work, spring, rest = window.value(digits)
    assert work > spring > 0  # it goes into the spring, and friction takes some
    assert rest == pytest.approx(work - spring, abs=0.011)
    drawn = """[...document.querySelectorAll('#physics .pictures canvas')].map((canvas) =>
        new Set(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data).size)"""
    assert min(window.value(drawn)) > 5
    window.page.mouse.up()
    button.click()
    assert not panel.is_visible()


@pytest.mark.slow
def test_every_name_explains_itself(window):
    names = window.value("[...document.querySelectorAll('.term')].map((e) => e.textContent)")
    assert set(names) == set(FIGURES)
    explanation = window.page.locator("#explanation")
    for k, name in enumerate(names):
        term = window.page.locator(".term").nth(k)
        if not term.is_visible():  # the physics stand where the plots were
            window.page.locator("#open-physics").click()
        term.click()
        assert explanation.text_content() == FIGURES[name]
        box, size = explanation.bounding_box(), window.page.viewport_size
        assert 0 <= box["x"] <= size["width"] - box["width"]
        assert 0 <= box["y"] <= size["height"] - box["height"]
        window.page.keyboard.press("Escape")
        assert not explanation.is_visible()


def test_every_choice_is_offered_and_says_what_it_is(window):
    said = window.page.locator("#chosen")
    for name in ("scenario", "controller", "valves", "sensors"):
        offered = window.value(f"document.querySelector('select[name={name}]').options.length")
        assert offered == window.value(f"birthsim.hello.choices.{name}.length")
        window.page.locator(f"select[name={name}]").focus()
        about = f"birthsim.hello.choices.{name}.find((one) => one.name === birthsim.settings.{name}).about"
        assert said.text_content() == window.value(about) != ""
    window.choose(scenario="vacuum")
    window.page.locator("select[name=scenario]").focus()
    window.wait("document.querySelector('#chosen').textContent.startsWith('A vacuum cup')")


@pytest.mark.slow
def test_about_names_paper_licence_and_version(window):
    window.page.locator("#open-about").click()
    words = window.page.locator("#about").text_content()
    for part in (window.value("birthsim.hello.words.version"), PAPER["words"], "MIT licence", "docs/live.md"):
        assert part in words
    assert window.page.locator("#paper-link").get_attribute("href") == PAPER["address"]
    window.live(1.0)
    window.page.keyboard.press("r")  # behind a dialog nothing is reset
    window.live(0.1)
    assert window.frame()["time"] > 1.0
    window.page.keyboard.press("Escape")
    assert not window.page.locator("#about").is_visible()


def saved(window, button):
    window.page.locator("[popovertarget=files]").click()
    with window.page.expect_download() as download:
        window.page.locator(button).click()
    return download.value.path().read_bytes()


@pytest.mark.slow
def test_what_is_shown_is_saved_as_numbers_and_as_a_picture(window):
    window.live(0.5)
    window.pause()
    rows = list(csv.reader(io.StringIO(saved(window, "#save-csv").decode())))
    assert rows[0][:3] == ["time (s)", "error (mm)", "error_rms (mm)"]
    shown = window.value("[...birthsim.plots.shown.history.view('position_x')]")
    column = [float(row[rows[0].index("position_x (mm)")]) for row in rows[1:]]
    assert column == pytest.approx(shown, rel=1e-6)
    picture = saved(window, "#save-png")
    assert picture.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", picture[16:24])
    beside = window.value("document.querySelector('#settings').getBoundingClientRect().width")
    assert width == pytest.approx(window.page.viewport_size["width"] - beside, abs=2)
    assert height > 600
