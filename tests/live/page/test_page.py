"""The live page in headless Chromium, pushed and looked at as a person would: real mouse and key events."""

from tests.live.browser import NARROW, Window


def test_every_choice_is_offered(window):
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
