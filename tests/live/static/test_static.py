"""The page without a server in headless Chromium: a folder of files, a rig in a worker, and Python's bits."""

from __future__ import annotations

import base64
import os
import shutil

import numpy as np
import pytest

from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_live.rig.frames import COLUMNS
from birthsim_live.rig.hand import Hold, Push
from birthsim_live.rig.recording import load_recording
from birthsim_live.rig.session import Session
from birthsim_live.rig.settings import opening_settings
from tests.live.browser import CALM, NARROW, Folder, Window, displacement, rendered
from tests.live.static.lack import lack

LACK = lack()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(LACK) and os.environ.get("CI") != "true", reason=LACK)]

LARGEST = 1.5e6  # bytes
SOONEST = 2.0  # s from the address to a rig that moves
ROWS = """async (cases) => {
  const { load } = await import(new URL("rig/birthsim.js", location));
  const { Session } = await import(new URL("static/worker/session.js", location));
  const { rowOf } = await import(new URL("static/worker/frames.js", location));
  const read = async (name) => await fetch(new URL(`rig/${name}`, location));
  const pack = await (await read("pack.json")).json();
  const [code, data] = [await (await read("loop.wasm")).arrayBuffer(), await (await read("loop.bin")).arrayBuffer()];
  const found = [];
  for (const { settings, periods, hold } of cases) {
    const session = new Session(pack, await load({ code, data }));
    session.change(settings);
    session.reset();
    if (hold) session.hands.hold = { ...hold, id: 1 };
    const rows = [];
    for (let k = 0; k < periods; k += 1) {
      session.advance(1, Infinity);
      rows.push(...rowOf(session), ...(session.second ? rowOf(session.second) : []));
    }
    const bytes = new Uint8Array(Float64Array.from(rows).buffer);
    let text = "";
    for (let k = 0; k < bytes.length; k += 8192) text += String.fromCharCode(...bytes.subarray(k, k + 8192));
    found.push(btoa(text));
  }
  return found;
}"""
"""Rows of every period of sessions with settings, and of the rigs beside theirs."""


SILENT = """async () => {
  const { load } = await import(new URL("rig/birthsim.js", location));
  const { Hub } = await import(new URL("static/worker/hub.js", location));
  const pack = await (await fetch(new URL("rig/pack.json", location))).json();
  const read = async (name) => (await fetch(new URL(`rig/${name}`, location))).arrayBuffer();
  const [code, data] = [await read("loop.wasm"), await read("loop.bin")];
  const bundle = await load({ code, data });
  pack.numbers.patience = 0.2;
  const held = [];
  return new Promise((resolve) => {
    const hub = new Hub(pack, bundle, ({ type, pointer }) => {
      if (type === "frame") held.push(pointer !== null);
      if (held.includes(true) && held.at(-1) === false) resolve(true);
    });
    setTimeout(() => resolve(false), 60e3);
    hub.start();
    hub.receive({ type: "drag", position: [0.53, 0], id: 1 });
  });
}"""
"""True once a rig has let go of a hand that said a single word."""


@pytest.fixture
def window(chromium, address):
    with Window(chromium, address + CALM) as opened:
        opened.wait("birthsim.settings.controller === 'admittance-backstepping'")
        yield opened
        assert opened.complaints == []
        assert opened.foreign == []


def same(found, expected):
    """Whether two arrays have the same bits, apart from those of NaN."""
    return bool(np.all((found == expected) | (np.isnan(found) & np.isnan(expected))))


def rows_of(settings, periods, hold=None):
    """Rows of every period of a session in Python, (periods, COLUMNS for each rig); a hand that does ``hold`` acts from the
    start."""
    rig = load_parameters(None)
    session = Session(rig, opening_settings(rig))
    session.change(settings)
    session.reset()
    for kind, value in (hold or {}).items():
        session.hands.hold = {"position": Hold, "force": Push}[kind](np.array(value, dtype=float), 1)
    rigs = [session, session.second] if session.second else [session]
    rows = np.empty((periods, len(rigs) * COLUMNS))
    for row in rows:
        session.advance(1)
        row[:] = np.concatenate([rig.row() for rig in rigs])
    return rows


def test_the_folder_is_small(whole):
    assert sum(path.stat().st_size for path in whole.rglob("*") if path.is_file()) < LARGEST


def test_the_rig_moves_soon(chromium, address):
    soonest = []
    for _ in range(3):  # a busy machine may be late once
        with Window(chromium, address) as window:
            soonest.append(window.wait("birthsim.frame.time > 0 && performance.now()"))
    assert min(soonest) < 1e3 * SOONEST


def test_rigs_under_every_controller_sensor_and_scenario_have_the_bits_of_python(chromium, whole):
    with Folder(whole) as served, Window(chromium, served + CALM) as window:
        assert_bits_of_python(
            window, {"backstepping", "admittance-backstepping", "residual:circle", "lqr", "pid", "residual:circle_lab"}, 400
        )
        assert window.complaints == []


def assert_bits_of_python(window, controllers, periods):
    offered = window.value("birthsim.hello.choices.controller.filter(({ missing }) => !missing).map(({ name }) => name)")
    offered = [name for name in offered if not name.endswith("own")]  # a copy of one that is shipped
    assert controllers <= set(offered)
    pushed = {"scenario_force": True}
    cases = [{"scenario": name, "sensors": sensors} for name in SCENARIOS for sensors in SENSORS]
    cases += [
        {"scenario": "circle", "controller": name, "sensors": sensors} for name in offered for sensors in ("ideal", "lab")
    ]
    cases += [{"scenario": "circle", "mass": 4.3, "friction": 1.37, "Kclx": 3150.0, "valves": "one_valve", "damping": 1.5}]
    several = [{"settings": {**case, **pushed}, "periods": periods} for case in cases]
    holds = [{"position": [0.56, 0.02]}, {"position": [0.7, -0.2]}, {"force": [20, -5]}, {"force": [90, 90]}]
    several += [{"settings": {}, "periods": periods, "hold": hold} for hold in holds]
    pairs = [("backstepping", "admittance-backstepping"), ("residual:circle", "backstepping"), ("pid", "residual:circle_lab")]
    for controller, compare in ((one, other) for one, other in pairs if {one, other} <= set(offered)):
        settings = {"controller": controller, "compare": compare, "scenario": "circle", "sensors": "lab", "mass": 4.0}
        several.append({"settings": {**settings, **pushed}, "periods": periods, "hold": holds[0]})
    texts = window.page.evaluate(ROWS, several)
    for one, text in zip(several, texts, strict=True):
        found = np.frombuffer(base64.b64decode(text)).reshape(periods, -1)
        assert same(found, rows_of(**one)), one


def test_displacement_is_force_over_stiffness(window):
    spring = window.page.locator("#set-drag_stiffness")
    spring.press("Home")
    window.wait("birthsim.settings.drag_stiffness === birthsim.hello.ranges.drag_stiffness.min")
    window.hold(across=90)
    frame = window.settle(least=10)
    assert displacement(frame)[0] > 5e-3
    assert displacement(frame)[0] == pytest.approx(rendered(frame)[0], rel=0.1)
    window.page.mouse.up()
    window.wait("birthsim.frame.pointer === null && Math.hypot(...birthsim.frame.force) === 0")
    drawn = window.value("birthsim.monitor.report().drawn")
    window.wait(f"birthsim.monitor.report().drawn > {drawn + 20} && birthsim.frame.real_time > 0.5")


@pytest.mark.parametrize("compare", ["nothing", "backstepping"])
def test_a_recorded_episode_has_the_bits_of_python(window, tmp_path, compare):
    page = window.page
    page.locator("select[name=compare]").select_option(compare)
    window.wait(f"birthsim.settings.compare === '{compare}'")
    page.locator("select[name=scenario]").select_option("circle")
    page.locator("input[name=scenario_force]").check()
    window.wait("birthsim.settings.scenario === 'circle' && birthsim.settings.scenario_force")
    window.live(0.3)
    page.locator("#record").click()
    window.wait("birthsim.state.recording !== null")
    page.locator("#pause").click()
    window.wait("birthsim.state.paused")
    page.locator("#reset").click()
    window.wait("birthsim.frame.time === 0")  # paused, it stays there
    page.locator("#pause").click()
    window.wait("birthsim.frame.time > 1.5")
    page.locator("#record").click()
    window.wait("birthsim.state.recording === null && birthsim.state.last_recording !== null")
    with page.expect_download() as download:
        page.locator("#download").click()
    download.value.save_as(tmp_path / "circle.rec")
    page.locator("#choose").set_input_files(tmp_path / "circle.rec")
    window.wait("birthsim.hello.mode === 'replay' && birthsim.state.file === 'circle.rec' && birthsim.frame.time > 0")
    page.locator("#back").click()
    window.wait("birthsim.hello.mode === 'live'")
    recording = load_recording(tmp_path / "circle.rec")
    begun = int(np.argmin(recording.rows[:, 0]))
    rows = np.hstack([recording.rows, recording.second])[begun:]
    assert len(rows) > 300
    instants = np.round(rows[:, 0] / 0.001).astype(int)
    settings = {"scenario": "circle", "scenario_force": True, "controller": CALM.partition("=")[2], "compare": compare}
    expected = rows_of(settings, int(instants[-1]))
    moved = instants > 0
    assert same(rows[moved, : expected.shape[1]], expected[instants[moved] - 1])
    assert np.isfinite(rows[moved, COLUMNS]).all() == (compare != "nothing")


def test_one_hand_pulls_both_heads_and_keys_push_both(chromium, address):
    with Window(chromium, f"{address}?controller=admittance-backstepping&compare=residual:circle") as window:
        window.wait("birthsim.frame.second !== null && document.body.dataset.rigs === '2'")
        x, y = window.value("birthsim.pixel(birthsim.frame.second.position, 1)")
        window.page.mouse.move(x, y)
        window.page.mouse.down()
        window.page.mouse.move(x + 40, y, steps=6)
        window.wait("birthsim.frame.second.force[0] > 5 && birthsim.frame.force[0] > 5")
        frame = window.frame()
        assert frame["pointer"] == frame["second"]["pointer"]
        window.page.mouse.up()
        window.wait("birthsim.frame.pointer === null && birthsim.frame.second.pointer === null")
        window.page.keyboard.down("ArrowDown")
        window.wait("birthsim.frame.force[1] === -20 && birthsim.frame.second.force[1] === -20")
        window.page.keyboard.up("ArrowDown")
        window.wait("birthsim.frame.second.force[1] === 0")
        window.page.locator("select[name=compare]").select_option("nothing")
        window.wait("birthsim.frame.second === null && document.body.dataset.rigs === '1'")
        assert window.complaints == []


def test_a_policy_of_ones_own_opens_the_page(chromium, address):
    with Window(chromium, address) as window:
        window.wait("birthsim.settings.controller.endsWith('own') && birthsim.frame.lost === null")
        window.wait("document.querySelector('select[name=controller]').selectedOptions[0].text.includes('own')")
        window.live(0.2)
        assert window.complaints == []


def test_every_choice_runs_in_the_window(window):
    for name in ("scenario", "controller", "valves", "sensors"):
        choices = window.value(f"birthsim.hello.choices.{name}.filter((c) => !c.missing).map((c) => c.name ?? c)")
        for choice in choices:
            window.page.locator(f"select[name={name}]").select_option(choice)
            window.wait(f"birthsim.settings.{name} === {choice!r}")
            begun = window.frame()
            window.wait(f"birthsim.frame.time > {begun['time'] + 0.1} || birthsim.frame.lost")
            assert window.frame()["lost"] is None, (name, choice)


def test_a_hand_that_falls_silent_lets_go(window):
    assert window.page.evaluate(SILENT)


def test_what_is_not_allowed_is_named_and_changes_nothing(chromium, address):
    with Window(chromium, address, NARROW) as window:
        window.wait("birthsim.settings.controller.endsWith('own')")  # the policy arrives after the page
        before = window.value("birthsim.settings")
        window.page.evaluate("() => window.birthsim.send({ type: 'set', settings: { mass: 900 } })")
        window.wait("document.querySelector('#notices').textContent.includes('mass = 900; allowed: 1.5 to 6 kg')")
        window.live(0.1)
        assert window.value("birthsim.settings") == before


def test_a_file_that_is_missing_is_named(chromium, built, tmp_path):
    folder = tmp_path / "page"
    shutil.copytree(built, folder)
    (folder / "rig" / "loop.wasm").unlink()
    with Folder(folder) as served:
        page = chromium.new_page()
        page.goto(served)
        page.locator("#offline", has_text="loop.wasm is missing (404)").wait_for()
        page.close()
