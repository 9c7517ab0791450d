"""Messages to the rig with missing, odd or boundless fields: refused by name, and nothing of them is done."""

from tests.live.rig.worker import node

SCRIPT = """
import { Hub } from "./worker/hub.js";

const posted = [];
const hub = new Hub(pack, bundle, (message) => posted.push(message));
const before = text(hub.session.loop.rows);
const told = [];
for (const words of given) {
  posted.length = 0;
  await hub.receive(JSON.parse(words));
  const { session, clock } = hub;
  const same = text(session.loop.rows) === before;
  told.push([posted.map(({ message }) => message), session.hands.hold, same, clock.paused, clock.speed]);
}
console.log(JSON.stringify(told));
process.exit(0);
"""
ODD = {
    "null": "drag",
    "5": "drag",
    "[]": "drag",
    '"drag"': "drag",
    "{}": "drag",
    '{"type":"dragg"}': 'did you mean "drag"',
    '{"type":"constructor"}': "drag",
    '{"type":"__proto__"}': "drag",
    '{"type":{"a":1}}': "drag",
    '{"type":"drag"}': "position",
    '{"type":"drag","position":null}': "position",
    '{"type":"drag","position":[1]}': "position",
    '{"type":"drag","position":[1,null]}': "position",
    '{"type":"drag","position":["0.5","0"]}': "position",
    '{"type":"drag","position":[1e999,0]}': "position",
    '{"type":"push","force":[1e5,0]}': "up to 100 N",
    '{"type":"push","force":{"x":1}}': "force",
    '{"type":"pause"}': "paused",
    '{"type":"pause","paused":"yes"}': "paused",
    '{"type":"speed","speed":0}': "0.05 to 1",
    '{"type":"speed","speed":null}': "0.05 to 1",
    '{"type":"record","on":1}': "on",
    '{"type":"device","on":null}': "on",
    '{"type":"hidden"}': "hidden",
    '{"type":"set"}': "settings",
    '{"type":"set","settings":null}': "settings",
    '{"type":"set","settings":[1]}': "settings",
    '{"type":"set","settings":{"mass":null}}': "1.5 to 6 kg",
    '{"type":"set","settings":{"__proto__":{"mass":3}}}': "no such setting",
    '{"type":"learned"}': "network",
    '{"type":"learned","network":{"widths":[2,3]}}': "network",
    '{"type":"learned","network":{"widths":[2,1],"weights":[0,0,null],"mean":[0,0],"deviation":[1,1]}}': "network",
    '{"type":"seek","time":0}': "drag",
}


def test_an_odd_message_is_refused_by_name_and_changes_nothing(page):
    for (words, named), (said, hold, same, paused, speed) in zip(ODD.items(), node(page, SCRIPT, list(ODD)), strict=True):
        assert len(said) == 1, words
        assert "allowed" in said[0], words
        assert named in said[0], (words, said)
        assert len(said[0]) < 400, words
        assert (hold, same, paused, speed) == (None, True, False, 1), words


ANSWERS = """
import { Remote } from "./worker/remote.js";

globalThis.WebSocket = class {
  constructor() { this.heard = {}; }
  addEventListener(kind, act) { (this.heard[kind] ??= []).push(act); }
  send() {}
  close() {}
};
const kinds = {
  openings: (values) => Float64Array.from(values, Number).buffer,
  bytes: (size) => new ArrayBuffer(size),
  text: (words) => words,
};
console.log(JSON.stringify(given.map(([kind, value]) => {
  const remote = new Remote("mine");
  remote.socket.heard.message.forEach((act) => act({ data: kinds[kind](value) }));
  const filled = [];
  const fault = remote.act({ fill: (_, values) => filled.push(...values) });
  return [fault, filled];
})));
"""


def test_what_python_answers_is_four_openings_or_words(page):
    """The place of the page is no file here: addresses of sockets are those of a server."""
    cases = [["openings", [0, 1, -1, 0.5]], ["openings", ["NaN", 0, 0, 0]], ["openings", [2, 0, 0, 0]], ["openings", [0, 0, 0]]]
    cases += [["bytes", 7], ["bytes", 0], ["text", "ValueError: no"]]
    good, *odd, words = node(page, ANSWERS, cases)
    assert good == [None, [0, 1, -1, 0.5]]
    for fault, filled in odd:
        assert "allowed: 4 openings from -1 to 1" in fault
        assert filled == []
    assert words == ["ValueError: no", []]
