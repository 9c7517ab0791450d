"""The live page in headless Chromium, pushed and looked at as a person would: real mouse and key events."""

import pytest

from tests.live.browser import NARROW, Window, displacement, rendered


def slide(window, name, value):
    """Move a slider with the arrow keys until the rig has taken ``value`` over."""
    slider = window.page.locator(f"#set-{name}")
    for _ in range(200):
        now = window.value(f"birthsim.settings.{name}")
        if now == pytest.approx(value):
            return
        slider.press("ArrowRight" if value > now else "ArrowLeft")
        window.wait(f"birthsim.settings.{name} !== {now!r}")
    raise AssertionError(f"{name} never became {value}")


def test_displacement_is_force_over_stiffness_and_halves_at_twice_the_stiffness(window):
    # A soft spring held far away pulls almost as hard when the end effector gives way.
    window.page.locator("#set-drag_stiffness").press("Home")
    window.wait("birthsim.settings.drag_stiffness === birthsim.hello.ranges.drag_stiffness.min")
    window.hold(across=90)
    soft = window.settle(least=10)
    stiffness = soft["stiffness"][0]
    assert displacement(soft)[0] > 5e-3
    assert displacement(soft)[0] == pytest.approx(rendered(soft)[0], rel=0.1)

    # Figures are written a few times a second: those of the rest follow.
    digits = "document.querySelector('[data-figure=displacement] dd span').innerText"
    shown = f"{digits}.replaceAll('\u2212', '-').split(/\\s+/).map(Number)"
    wanted = [1e3 * part for part in displacement(soft)]
    window.wait(f"{wanted}.every((part, k) => Math.abs(part - ({shown})[k]) < 0.5)")

    slide(window, "Kclx", 2 * stiffness)
    window.wait(f"birthsim.frame.stiffness[0] > {1.99 * stiffness}")
    stiff = window.settle(least=10)
    assert displacement(stiff)[0] == pytest.approx(rendered(stiff)[0], rel=0.1)
    assert displacement(stiff)[0] / displacement(soft)[0] == pytest.approx(0.5, rel=0.1)

    window.page.mouse.up()
    window.wait("birthsim.frame.pointer === null && Math.hypot(...birthsim.frame.force) === 0")
    window.page.locator("#stiffness-source").click()
    window.wait(f"birthsim.settings.stiffness_source === 'scenario' && birthsim.settings.Kclx === {stiffness}")


def test_every_input_has_a_name_and_every_choice_is_offered(window):
    nameless = window.value(
        "[...document.querySelectorAll('input, select, button')]"
        ".filter((e) => !(e.labels?.length || e.textContent.trim() || e.ariaLabel)).map((e) => e.outerHTML)"
    )
    assert nameless == []
    for name in ("scenario", "controller", "valves", "sensors"):
        offered = window.value(f"document.querySelector('select[name={name}]').options.length")
        assert offered == window.value(f"birthsim.hello.choices.{name}.length")


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
