"""What the page teaches: it opens with a problem that can be seen, leads through seven lessons, and is a link."""

import json

import pytest

from tests.live.browser import Window

FELT = "document.querySelector('[data-figure=\"the hand feels\"] dd').textContent"
MARKED = "document.querySelectorAll('.look').length"
LESSON = "document.querySelector('#guide').value"


def test_the_page_opens_with_a_problem_a_cue_and_its_headline(chromium, server):
    with Window(chromium, server.url) as window:
        assert window.value(LESSON) == "Feel the friction"
        assert window.value("birthsim.settings.controller") == "backstepping"
        assert window.value("location.search") == ""
        assert window.value("birthsim.scenes[0].cue")
        assert window.value(FELT).startswith("–")
        window.hold(across=50)
        assert not window.value("birthsim.scenes[0].cue")
        window.wait(f"/^2,[1-9]\\d0 N.m, asked for 2,000$/.test({FELT})")


def test_the_lessons_follow_each_other_set_the_rig_and_show_where_to_look(window):
    wanted = {
        "Feel the friction": {"controller": "backstepping", "mass": 3, "stiffness_source": "scenario"},
        "Take the friction away": {"controller": "backstepping", "friction": 0},
        "Halve the stiffness": {"controller": "backstepping", "Kclx": 1000, "Kcly": 1000, "stiffness_source": "sliders"},
        "What the force sensor buys": {"controller": "admittance-backstepping", "compare": "backstepping"},
        "What learning adds": {"controller": "residual:circle", "compare": "backstepping", "scenario": "circle", "mass": 4},
        "Learn it here": {"controller": "learning", "scenario": "circle", "scenario_force": True, "compare": "nothing"},
        "Forceps pull": {"scenario": "forceps", "scenario_force": True, "friction": 1, "compare": "nothing"},
    }
    window.page.locator("#guide").select_option("Feel the friction")
    places = set()
    for name, settings in wanted.items():
        set_so = f"Object.entries({json.dumps(settings)}).every(([name, value]) => birthsim.settings[name] === value)"
        window.wait(f"{set_so} && {LESSON} === '{name}' && {MARKED} === 1")
        places.add(window.value("document.querySelector('.look').outerHTML.slice(0, 60)"))
        assert window.value("document.querySelector('#lesson').textContent.split(/[.:] /).length") >= 2
        window.page.locator("#next").click()
    assert len(places) == len(wanted)
    window.wait(f"{LESSON} === 'Feel the friction'")
    window.choose(controller="lqr")
    window.wait(f"{LESSON} === 'Your own settings'")
    window.choose(controller="admittance-backstepping", compare="backstepping")
    window.wait(f"{LESSON} === 'What the force sensor buys'")


@pytest.mark.slow
def test_the_settings_are_a_link(chromium, server):
    asked = "?controller=pid&Kclx=3000&friction=0.5&scenario_force=true"
    with Window(chromium, server.url + asked) as window:
        window.wait("birthsim.settings.controller === 'pid' && birthsim.settings.Kclx === 3000")
        now = window.value("birthsim.settings")
        assert (now["friction"], now["scenario_force"], now["Kcly"]) == (0.5, True, 2000)
        window.choose(sensors="lab")
        window.wait("location.search.includes('sensors=lab') && location.search.includes('controller=pid')")
        window.page.locator("#guide").select_option("Feel the friction")
        window.wait("location.search === ''")


def test_a_link_that_asks_for_the_impossible_is_refused_by_name(chromium, server):
    with Window(chromium, f"{server.url}?mass=900") as window:
        window.wait("document.querySelector('#notices').textContent.includes('mass = 900; allowed: 1.5 to 6 kg')")
        assert window.value("birthsim.settings.mass") == 3
