"""Controllers that run in Python for a rig in a browser: numbers in, openings out, or why not."""

import threading
from itertools import pairwise

import numpy as np
import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from birthsim_env.loop.rows import ASKED, OPENING, WORLD, Signals
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.folder import offer, packed_page
from lab.studies.targets.reference import whole_rows
from tests.live.server.conftest import HERE

SOCKET = "ws://127.0.0.1:8000/controller?name="
OWN = """
import time

import numpy as np
from baselines.named import make_controller

class Law:
    def __init__(self, parameters):
        self.own, self.calls = make_controller("backstepping", parameters), 0
    def reset(self, lanes=None):
        pass
    def before(self):
        pass
    def command(self, measurement, reference):
        self.calls += 1
        return self.own.command(measurement, reference) if self.before() is None else np.full((4, 1), 2.0)

class Wide(Law):
    def before(self):
        return 2.0

class Fails(Law):
    def before(self):
        return self.calls / 0

class Slow(Law):
    def before(self):
        time.sleep(0.02)

class Ends(Law):
    def before(self):
        raise SystemExit("enough")

class Hangs(Law):
    def before(self):
        time.sleep(5.0)
"""
HELD = """
from tests.live.server.test_controller import GOES_ON, HANGS, LET_GO

class Held(Law):
    def before(self):
        if self.calls > 10:
            HANGS.set()
            GOES_ON.append(LET_GO.wait(60.0))
"""
HANGS, LET_GO = threading.Event(), threading.Event()
GOES_ON = []


def numbers(rows=None, sampled=False):
    """What the page sends: a head at rest on its target, which 2000 N/m hold, where no rows are given."""
    if rows is None:
        signals = Signals(np.zeros(ASKED))
        signals.position[0] = signals.reference.position[0] = 0.5
        signals.reference.stiffness[:], signals.pressure[:] = 2000.0, 3e5
        rows = signals.rows
    return np.concatenate([[float(sampled)], rows]).tobytes()


@pytest.fixture
def own(tmp_path):
    (tmp_path / "mine.py").write_text(OWN + HELD)
    return str(tmp_path / "mine.py")


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_it_answers_what_it_commands_in_a_loop(sensors, own, app):
    seen = whole_rows("circle", sensors, "backstepping", 100)[:, WORLD:]
    name = f"{own}:Law"
    with TestClient(app(name), base_url=HERE) as live, live.websocket_connect(SOCKET + name) as ws:
        for before, after in pairwise(seen):
            ws.send_bytes(numbers(before[:ASKED], sensors == "lab"))
            assert np.array_equal(np.frombuffer(ws.receive_bytes()), after[OPENING : OPENING + 4])


ENDS = {
    "Ends": "it ends Python: SystemExit: enough",
    "Fails": "ZeroDivisionError: division by zero",
    "Wide": "command()[0, 0] = 2.0; allowed",
    "None": "has no 'None'",
}


@pytest.mark.parametrize(("kind", "said"), ENDS.items())
def test_one_that_gives_up_says_why_and_is_closed(kind, said, own, app, capfd):
    name = f"{own}:{kind}"
    with TestClient(app(name), base_url=HERE) as live, live.websocket_connect(SOCKET + name) as ws:
        ws.send_bytes(numbers())
        assert said in ws.receive_text()
        with pytest.raises(WebSocketDisconnect):
            ws.receive_text()
    assert "Traceback" in capfd.readouterr().err  # where the author looks


def test_one_that_hangs_stops_nothing_else(own, app):
    hanging, other = f"{own}:Held", f"{own}:Law"
    with TestClient(app(hanging, other), base_url=HERE) as live, live.websocket_connect(SOCKET + hanging) as ws:
        for _ in range(10):
            ws.send_bytes(numbers())
            last = ws.receive_bytes()
        ws.send_bytes(numbers())
        assert HANGS.wait(60.0)
        assert live.get("/").status_code == 200
        with live.websocket_connect(SOCKET + other) as beside:
            beside.send_bytes(numbers())
            assert beside.receive_bytes() == last
        assert GOES_ON == []  # it has hung all the while
        LET_GO.set()
        assert len(ws.receive_bytes()) == len(last)


ODD = [
    *({"bytes": content} for content in (b"", b"\0" * 7, b"\0" * 8 * ASKED, b"\0" * 3000)),
    *({"bytes": np.concatenate([[first], np.zeros(ASKED)]).tobytes()} for first in (np.nan, np.inf, 2.0, -1.0)),
    *({"text": words} for words in ("", "{}", "a" * 3000, "null")),
]


@pytest.mark.parametrize("message", ODD)
def test_what_is_no_measurement_is_refused(message, live, capfd):
    """In words for whoever sent it; it is no fault of the controller, whose author is shown none."""
    with live.websocket_connect(SOCKET + "shut-valves") as ws:
        ws.send({"type": "websocket.receive", **message})
        said = ws.receive_text()
        assert said.startswith("ValueError: ")
        assert "allowed: " in said
        assert len(said) < 300
        with pytest.raises(WebSocketDisconnect) as ended:
            ws.receive_text()
    assert ended.value.code == 1003
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("name", ["", "pid", "nobody", "/etc/passwd", "mine.py:Law"])
def test_what_is_not_offered_does_not_run(name, live):
    with pytest.raises(WebSocketDisconnect), live.websocket_connect(SOCKET + name) as ws:
        ws.receive_text()


def test_the_page_offers_what_python_can_run(own):
    content = packed_page(Parameters()).content
    missing = [one["name"] for one in content["hello"]["choices"]["controller"] if "missing" in one]
    assert missing == ["shut-valves", "slammed-valves", "random-valves"]
    offer(content, Parameters(), [f"{own}:Law", "backstepping"])
    assert content["python"] == [*missing, f"{own}:Law"]
    for name in ("controller", "compare"):
        choices = {one["name"]: one for one in content["hello"]["choices"][name]}
        assert choices[f"{own}:Law"]["title"] == "mine.py:Law"
        assert all("missing" not in choices[name] for name in missing)
    with pytest.raises(ValueError, match=r"controller = 'nobody'"):
        offer(content, Parameters(), ["nobody"])
