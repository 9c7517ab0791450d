"""A recording that is opened on the page: dropped or chosen, played, searched, and refused in a line where it is none."""

import base64
import struct

import numpy as np
import pytest

from birthsim_env.physics.linkage.geometry import end_effector
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs.recording import FIELDS, SLICES, load_recording
from tests.live.browser import Server, Window
from tests.live.recordings.made import example, write_recording

DROP = """([bytes, name]) => {
    const data = new DataTransfer();
    const content = typeof bytes === "number" ? new Uint8Array(bytes) : Uint8Array.from(atob(bytes), (c) => c.charCodeAt(0));
    data.items.add(new File([content], name));
    const event = (kind) => new DragEvent(kind, { dataTransfer: data, bubbles: true, cancelable: true });
    window.dispatchEvent(event("dragover"));
    window.shaded = !document.querySelector("#drop").hidden;
    window.dispatchEvent(event("drop"));
}"""
"""What a browser does when somebody drops a file."""
OTHER = Parameters().replace({"geometry.d6": 0.26, "valves.hysteresis": 0.02})
NOTICES = "document.querySelector('#notices').textContent"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """2 s: at rest, a pull, another law."""
    return write_recording(tmp_path_factory.mktemp("recordings") / "pull.rec", example(500))


def drop(window, content, name="pull.rec"):
    window.page.evaluate(DROP, [content if isinstance(content, int) else base64.b64encode(content).decode(), name])


def test_a_dropped_recording_is_played_searched_and_left(window, file):
    lesson = window.value("document.querySelector('#guide').value")
    drop(window, file.read_bytes())
    window.wait("birthsim.hello.mode === 'replay' && birthsim.state.file === 'pull.rec'")
    assert window.value("window.shaded && document.querySelector('#drop').hidden")
    assert not window.page.locator("#settings").is_visible()
    window.pause()  # at its end it has halted by itself
    recording = load_recording(file)
    duration = recording.duration
    assert window.value("birthsim.state.duration") == pytest.approx(duration)
    assert window.value("birthsim.plots.shown.history.view('time').at(-1)") == pytest.approx(duration, abs=0.03)
    for time in (0.1, 0.998, 1.5, duration):
        window.page.evaluate(f"() => window.birthsim.send({{ type: 'seek', time: {time} }})")
        window.wait(f"Math.abs(birthsim.frame.time - {time}) < 1e-9")
        frame, row = window.frame(), np.array([np.interp(time, recording.rows[:, 0], one) for one in recording.rows.T])
        for name in {*FIELDS} - {"pointer", "time"}:
            assert np.allclose(np.ravel(frame[name]), row[SLICES[name]], rtol=1e-5, atol=1e-7), (time, name)
        off = row[SLICES["position"]] - row[SLICES["compliant"]]
        assert frame["error_mm"] == pytest.approx(1e3 * np.hypot(*off))
        assert frame["linkage"][3] == pytest.approx(end_effector(row[SLICES["joints"]][:, None], recording.rig)[:, 0])
    assert "backstepping" in window.page.locator("#played").text_content()
    assert "Kclx 3000 N/m" in window.page.locator("#played").text_content()
    window.back()
    window.wait("birthsim.frame.real_time !== null")
    assert window.page.locator("#settings").is_visible()
    assert window.value("document.querySelector('#guide').value") == lesson
    window.hold(across=30)
    window.wait("birthsim.frame.force[0] > 5")


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("foreign", "large", "shape")]


@pytest.mark.parametrize("damage", ["checksum", *SLOW])
def test_what_is_none_is_refused_in_a_line(window, file, tmp_path, damage):
    whole, other = file.read_bytes(), write_recording(tmp_path / "a.rec", example(9), OTHER).read_bytes()
    content, words = {
        "foreign": (b"PK this is no recording", "is damaged or foreign"),
        "checksum": (whole[:400] + bytes([whole[400] ^ 1]) + whole[401:], "has another checksum"),
        "large": (2**27 + 1, "allowed: up to 134217728"),
        "shape": (other, "allowed: birthsim live --replay FILE"),
    }[damage]
    drop(window, content, f"{damage}.rec")
    window.wait(f"{NOTICES}.includes({words!r}) && {NOTICES}.includes('{damage}.rec')")
    assert "\n" not in window.value(NOTICES)
    assert window.value("birthsim.hello.mode") == "live"


@pytest.mark.slow
def test_a_file_that_ends_early_is_played_as_far_as_it_goes(window, file, tmp_path):
    (tmp_path / "torn.rec").write_bytes(file.read_bytes() + struct.pack("<II", 1000, 0) + bytes(10))
    window.play(tmp_path / "torn.rec")
    window.wait("birthsim.frame.time > 0")


@pytest.mark.slow
@pytest.mark.parametrize("rig", [Parameters(), OTHER])
def test_a_served_recording_of_any_rig_plays_by_itself_and_shows_all_curves(chromium, tmp_path, rig):
    file = write_recording(tmp_path / "pull.rec", example(500), rig)
    with Server("live", "--replay", file) as server, Window(chromium, server.url) as viewer:
        assert viewer.value("birthsim.plots.shown.history.view('time')[0]") == 0
        assert viewer.page.locator("#file").text_content() == "pull.rec"
        assert not viewer.page.locator("#back").is_visible()
        viewer.wait("birthsim.state.paused")  # at its end
        recording = load_recording(file)
        last = viewer.value("['time', 'force_x'].map((name) => birthsim.plots.shown.history.view(name).at(-1))")
        row = recording.rows[round(last[0] / recording.interval)]
        assert last[1] == pytest.approx(row[SLICES["drag_force"]][0], rel=1e-5)
        viewer.pause()  # from its end it would play on from wherever it is put
        viewer.page.locator("#scrub").fill("0.4")
        viewer.wait("Math.abs(birthsim.frame.time - 0.4) < 0.02")
        shown = "Number(document.querySelector('[data-figure=error] small').textContent.match(/[\\d.]+/)[0])"
        viewer.wait(f"Math.abs({shown} - birthsim.plots.shown.history.at('error_rms', 0.4)) < 0.006")
