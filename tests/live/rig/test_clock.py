"""Pace without a clock, in Node: what is due, what is dropped, and what is said about it."""

import pytest

from tests.live.rig.worker import node

SCRIPT = """
import { Pace } from "./worker/clock.js";
let now = 0;
globalThis.performance = { now: () => 1e3 * now };
const told = {};
const pace = (begins = 0) => {
  now = begins;
  return new Pace(0.001);
};
let one = pace(10);
told.due = [one.due(10.004, 1)];
now = 10.005;
one.ran(4);
told.due.push(one.due(10.008, 0.25), one.behind);
one = pace();
told.hiccup = [one.due(0.04, 1)];
one.ran(10);
told.hiccup.push(one.due(0.05, 1));
one.ran(40);
told.hiccup.push(one.due(1.06, 1), one.behind);
now = 2;
one.restart();
told.hiccup.push(one.behind, one.due(2, 1));
one = pace();
one.due(1, 0.1);
told.slow = one.behind;
one = pace();
told.factor = [one.factor(1)];
const run = (slices, most) => {
  for (let k = 0; k < slices; k += 1) {
    now += 0.004;
    one.ran(Math.min(one.due(now, 1), most));
  }
  told.factor.push(one.factor(1));
};
run(2000, 2);
told.behind = [one.behind, now];
run(300, 4);
told.factor.push(one.factor(0.5));
for (let k = 0; k < 300; k += 1) {
  now += 0.004; // a controller in Python is waited for
  one.ran(0);
}
told.factor.push(one.factor(1));
console.log(JSON.stringify(told));
"""
MOST_LAG = 0.05  # s


def test_pace(page):
    told = node(page, SCRIPT)
    assert told["due"] == [4, 1, 0], "it follows the wall and the speed"
    lost = 1.01 - MOST_LAG - 0.001
    assert told["hiccup"] == [40, 40, 51, pytest.approx(lost), 0, 0], "it is caught up with, and more is dropped and said"
    assert told["slow"] == pytest.approx(1.0 - MOST_LAG - 0.01), "in slow motion lag is wall time"
    # Over the last second, of a machine that runs half of what is due, then all of it, and then none.
    assert told["factor"] == [None, *(pytest.approx(one, rel=0.01) for one in (0.5, 1.0, 2.0)), 0.0]
    behind, passed = told["behind"]
    assert behind == pytest.approx(passed / 2, rel=0.02)
