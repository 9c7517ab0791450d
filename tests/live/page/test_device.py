"""A haptic device as the hand: a stub that speaks as the Haply Inverse Service does, over a real socket."""

import json
import threading
import time

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import serve

from tests.work.test_side_by_side import waited_for

PORT = 10001
FAR = 0.03  # m to the right
HIDDEN = """(value) => {
    Object.defineProperty(document, "hidden", { value, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
}"""


class Handle:
    """The service: says where the handle is, waits for a force, and says so again; ``answers`` are (s, N, N, N)."""

    def __init__(self):
        self.place, self.answers, self.odd = {"x": 0.1, "y": 0.0, "z": 0.2}, [], []
        try:
            self.server = serve(self.talk, "127.0.0.1", PORT)
        except OSError:
            pytest.skip(f"something listens on {PORT}")

    def talk(self, socket):
        try:
            while True:
                begun = time.perf_counter()
                device = {"device_id": "0A", "state": {"cursor_position": self.place}}
                for words in self.odd:
                    socket.send(words)
                    socket.recv()
                socket.send(json.dumps({"session_id": 1, "inverse3": [device]}))
                (command,) = json.loads(socket.recv())["inverse3"]
                assert command["device_id"] == "0A"
                values = command["commands"]["set_cursor_force"]["values"]
                self.answers.append((time.perf_counter() - begun, values["x"], values["y"], values["z"]))
                time.sleep(max(0.0, 1e-3 - (time.perf_counter() - begun)))
        except ConnectionClosed:
            pass

    def __enter__(self):
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_):
        self.server.shutdown()


def test_a_handle_feels_the_rig(window):
    button = window.page.locator("#device")
    button.click()
    window.wait("document.querySelector('#notices').textContent.includes('allowed: a running Haply Inverse Service')")
    window.complaints.clear()  # a browser complains of a socket that nobody answers
    with Handle() as handle:
        button.click()
        window.wait("birthsim.state.device && birthsim.frame.pointer !== null")
        handle.place = {**handle.place, "x": handle.place["x"] + FAR}
        frame = window.settle(least=10)
        # Two springs in series, that to the hand and the one that is rendered, share the way.
        stiffness, spring = frame["stiffness"][0], window.value("birthsim.settings.drag_stiffness")
        force = FAR / (1 / stiffness + 1 / spring)
        assert frame["force"][0] == pytest.approx(force, rel=0.02)
        assert handle.answers[-1][1:] == pytest.approx((-0.1 * force, 0.0, 0.0), rel=0.02, abs=0.05)
        # Odd words are ignored, counted and shown.
        handle.odd = ["null", '{"inverse3":[{"device_id":"0A","state":{"cursor_position":{"x":1e999,"y":0,"z":0}}}]}', b"\0\0"]
        window.wait("birthsim.state.device_ignored.count > 10")
        handle.odd = []
        window.wait("/ignored$/.test(document.querySelector('#device').textContent)")
        assert "allowed: " in window.value("document.querySelector('#notices').textContent")
        assert window.value("Math.hypot(...birthsim.frame.velocity)") < 0.05
        # Where nobody sees the page, the handle makes no force.
        window.page.evaluate(HIDDEN, True)
        waited_for(lambda: handle.answers[-1][1:] == (0, 0, 0))
        window.page.evaluate(HIDDEN, False)
        waited_for(lambda: handle.answers[-1][1] < -0.05 * force)
        button.click()
        window.wait("!birthsim.state.device && birthsim.frame.pointer === null")
