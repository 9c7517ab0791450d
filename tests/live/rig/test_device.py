"""The bridge to a haptic device against odd words of both sides, in Node with a clock of its own: a person holds the handle."""

import json
import math
from itertools import pairwise

import pytest

from tests.live.rig.worker import node

SCRIPT = """
let now = 1000;
Object.defineProperty(globalThis, "performance", { value: { now: () => now } });
globalThis.WebSocket = class {
  constructor() {
    Object.assign(this, { heard: {}, sent: [], closed: false });
    globalThis.socket = this;
  }
  addEventListener(kind, act) { this.heard[kind] = act; }
  send(words) { this.sent.push(JSON.parse(words).inverse3[0]); }
  close() { this.closed = true; }
};
const { Device } = await import("./worker/device.js");
const number = (value) => (value === null ? NaN : typeof value === "string" ? Number(value) : value);
console.log(JSON.stringify(given.map((steps) => {
  let force = [0, 0];
  let head = [0.5, 0];
  const [holds, ended] = [[], []];
  const session = { halted: false, some: (name) => (name === "x" ? head : force) };
  const clock = { paused: false, catchUp() {} };
  const hands = { on_drag: ({ position }) => holds.push(position), on_release: () => holds.push(null) };
  const hub = { session, clock, hidden: false, ...hands };
  const device = new Device(hub, (reason) => ended.push(reason ?? ""));
  for (const [kind, value] of steps) {
    if (kind === "says") socket.heard.message({ data: value });
    else if (kind === "binary") socket.heard.message({ data: new ArrayBuffer(value) });
    else if (kind === "passes") now += value;
    else if (kind === "force") force = value.map(number);
    else if (kind === "head") head = value.map(number);
    else if (kind === "halted") session.halted = value;
    else if (kind === "paused") hub.clock.paused = value;
    else if (kind === "hidden") hub.hidden = value;
    else if (kind === "close") socket.heard.close({});
    else device[kind](value);
  }
  return { holds, ended, sent: socket.sent, ignored: device.ignored, closed: socket.closed };
})));
"""
MOST = 10.0  # N that the device bears
STEP = 0.005  # m of the hand between two messages


def at(x, z=0.0, device="0A", **others):
    state = {"cursor_position": {"x": x, "y": 0.0, "z": z}}
    return "says", json.dumps({"inverse3": [{"device_id": device, "state": state, **others}]})


def alive(milliseconds, *each):
    """A handle that rests, for so long, every millisecond."""
    return [step for _ in range(milliseconds) for step in (*each, at(0.1), ("passes", 1))]


def forces(told):
    return [(v["x"], v["y"], v["z"]) for v in (one["commands"]["set_cursor_force"]["values"] for one in told["sent"])]


def sizes(told):
    return [math.hypot(*force) for force in forces(told)]


def run(page, *cases):
    return node(page, SCRIPT, [list(case) for case in cases])


WIDE = "1" * 400
ODD = {
    "no JSON": ("says", "x"),
    "nothing": ("says", ""),
    "null": ("says", "null"),
    "a number": ("says", "5"),
    "a list": ("says", "[]"),
    "deep": ("says", "[" * 60000),
    "long": ("says", " " * 70000),
    "inverse3 is null": ("says", '{"inverse3":null}'),
    "inverse3 is text": ("says", '{"inverse3":"0A"}'),
    "no device": ("says", '{"inverse3":[]}'),
    "device is null": ("says", '{"inverse3":[null]}'),
    "no state": ("says", '{"inverse3":[{"device_id":"0A"}]}'),
    "state is null": ("says", '{"inverse3":[{"device_id":"0A","state":null}]}'),
    "no place": ("says", '{"inverse3":[{"device_id":"0A","state":{}}]}'),
    "infinite": ("says", at(0.1)[1].replace("0.1", "1e999")),
    "digits": ("says", at(0.1)[1].replace("0.1", WIDE)),
    "far": at(40.0),
    "text": at("0.1"),
    "null place": at(None),
    "yes": at(True),
    "list": at([0.1]),
    "no id": ("says", at(0.1)[1].replace('"0A"', "null")),
    "id is a number": ("says", at(0.1)[1].replace('"0A"', "7")),
    "id is long": at(0.1, device="A" * 1000),
    "another device": at(0.1, device="0B"),
    "binary": ("binary", 4),
}


def test_odd_words_are_counted_and_move_nothing(page):
    """As the first words, and among good ones, where the device is still told a force."""
    first = run(page, *([odd] for name, odd in ODD.items() if name != "another device"))
    for told in first:
        assert (told["holds"], told["sent"], told["ended"], told["ignored"]["count"]) == ([], [], [], 1)
        assert "allowed: " in told["ignored"]["why"]
        assert len(told["ignored"]["why"]) < 200
    for told in run(page, *([at(0.1), odd, at(0.101)] for odd in ODD.values())):
        assert told["holds"] == [[0.5, 0.0], pytest.approx([0.501, 0.0])]
        assert [one["device_id"] for one in told["sent"]] == ["0A"] * 3
        assert (told["ended"], told["ignored"]["count"]) == ([], 1)


FORCES = [["nan", 0], [0, "nan"], ["Infinity", 0], ["-Infinity", "Infinity"], [1e5, -1e5], [1e308, 1e308], [200, 0], [3, 4]]


def test_forces_are_numbers_that_the_device_bears(page):
    for force, told in zip(FORCES, run(page, *([*alive(800), ("force", f), at(0.1)] for f in FORCES)), strict=True):
        x, y, z = forces(told)[-1]
        assert y == 0
        assert math.hypot(x, z) <= MOST * (1 + 1e-12)
        if all(isinstance(part, int | float) for part in force):
            share = min(0.1, MOST / math.hypot(*force))
            assert (x, z) == pytest.approx((-share * force[0], -share * force[1]), rel=1e-12)
        else:
            assert (x, z) == (0, 0)


def test_a_force_comes_by_and_by(page):
    """Neither at once, nor after a gap in which nothing was heard."""
    (told,) = run(page, [("force", [-80, 0]), *alive(700), ("passes", 90), at(0.1)])
    rise = sizes(told)
    assert rise[0] == 0
    assert rise[-1] == 8
    assert max(b - a for a, b in pairwise(rise)) < 0.02
    (gaps,) = run(page, [("force", [-80, 0]), *([at(0.1), ("passes", 90)] * 3), at(0.1)])
    assert sizes(gaps)[-1] < 1.0


LOSSES = {"halted": True, "paused": True, "hidden": True, "end": None}


@pytest.mark.parametrize("kind", LOSSES)
def test_a_force_goes_by_and_by(kind, page):
    (told,) = run(page, [("force", [-80, 0]), *alive(600), (kind, LOSSES[kind]), *alive(300)])
    course = sizes(told)
    assert max(course) == 8
    assert course[-1] == 0
    assert max(a - b for a, b in pairwise(course)) < 0.05
    assert told["ended"] == ([""] if kind == "end" else [])
    assert told["closed"] == (kind == "end")


def test_what_goes_can_come_back(page):
    (told,) = run(page, [("force", [-80, 0]), *alive(600), ("halted", True), *alive(300), ("halted", False), *alive(600)])
    assert sizes(told)[-1] == 8
    (stays,) = run(page, [("force", [-80, 0]), *alive(600), ("end", None), *alive(50), ("stay", None), *alive(600)])
    assert (sizes(stays)[-1], stays["ended"]) == (8, [])


def test_a_stream_that_goes_bad_or_silent_loses_its_force_and_then_the_hand(page):
    begun = [("force", [-80, 0]), *alive(600)]
    bad = [step for _ in range(2200) for step in (("says", "x"), ("passes", 1), ("watch", None))]
    silent = [step for _ in range(220) for step in (("passes", 10), ("watch", None))]
    for told, why in zip(run(page, [*begun, *bad], [*begun, *silent]), ("no JSON", "nothing"), strict=True):
        course = sizes(told)
        assert course[-1] == 0
        assert max(a - b for a, b in pairwise(course)) < 0.9
        assert told["holds"][-1] is None
        assert told["closed"]
        assert why in told["ended"][0]
        assert "allowed: " in told["ended"][0]


def test_a_leap_of_the_handle_is_no_blow(page):
    (told,) = run(page, [at(0.1), at(0.4, 0.4), at(0.1), at(0.1), at(0.1), at(0.1)])
    way = told["holds"]
    assert max(math.dist(a, b) for a, b in pairwise(way)) == pytest.approx(STEP)
    assert way[-1] == pytest.approx([0.5, 0.0])


def test_a_lost_rig_is_not_held(page):
    (told,) = run(page, [("head", ["nan", 0]), at(0.1), ("head", [0.5, 0]), at(0.2), at(0.201)])
    assert told["holds"] == [[0.5, 0.0], pytest.approx([0.501, 0.0])]


def test_a_service_that_goes_is_told_once(page):
    never, gone = run(page, [("close", None), ("close", None)], [at(0.1), ("close", None), ("end", None), at(0.2)])
    assert ["does not answer" in one for one in never["ended"]] == [True]
    assert ["has gone" in one for one in gone["ended"]] == [True]
    assert gone["holds"] == [[0.5, 0.0], None]
