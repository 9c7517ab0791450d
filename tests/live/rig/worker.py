"""The worker's rig in Node, which runs what a browser runs: its rows and what it says."""

import base64
import json
import subprocess
from typing import Any, NamedTuple

import numpy as np

from birthsim_build.layout import ROWS
from birthsim_live.logs.recording import COLUMNS, SLICES
from tests.build.targets import need_program

HEAD = """
import { readFileSync } from "node:fs";
import { load } from "./rig/birthsim.js";
const given = JSON.parse(readFileSync(0));
const pack = JSON.parse(readFileSync("rig/pack.json"));
const bundle = await load({ code: readFileSync("rig/loop.wasm"), data: readFileSync("rig/loop.bin") });
const text = (numbers) => Buffer.from(Float64Array.from(numbers).buffer).toString("base64");
"""
"""What every script has: its input, and the rig of the page."""
SCRIPT = """
import { frameOf, rowOf } from "./worker/frames.js";
import { Session } from "./worker/session.js";

const said = [];
const flat = (rows) => {
  const all = new Float64Array(rows.length && rows.length * rows[0].length);
  rows.forEach((row, k) => all.set(row, k * row.length));
  return text(all);
};
for (const steps of given) {
  const session = new Session(pack, bundle);
  const told = [];
  for (const [kind, value] of steps) {
    const rows = [[], [], [], []];
    const note = () => [session, session.second].forEach((one, k) => {
      if (one) rows[k].push(one.loop.rows.slice());
      if (one) rows[2 + k].push(rowOf(one));
    });
    if (kind === "set") session.change(value);
    else if (kind === "reset") session.reset();
    else if (kind === "hold") session.hands.hold = value && { ...value, id: 7 };
    else if (kind === "teach") session.teach(value);
    else if (kind === "put") (value[2] ? session.second : session).loop.set(value[0], value[1] ?? NaN);
    let done = 0;
    if (kind === "advance" || kind === "pass") {
      for (let k = 0; k < value; k += 1) {
        done += await session.advance(1, Infinity);
        if (kind === "advance") note();
      }
    }
    if (kind !== "advance") note();
    const { lost, halted } = session;
    told.push({ rows: rows.map(flat), done, frame: frameOf(session), lost, halted, settings: session.shownSettings() });
  }
  said.push(told);
}
console.log(JSON.stringify(said));
"""


class Told(NamedTuple):
    """After a step: all rows of the loops of both rigs, and those of recordings, of each of its periods, (T, rows) each; how
    many have run, what the page would show, why a rig is lost, whether both stand still, and what is set."""

    rows: np.ndarray
    second_rows: np.ndarray
    row: np.ndarray
    second_row: np.ndarray
    done: int
    frame: dict[str, Any]
    lost: str | None
    halted: bool
    settings: dict[str, Any]

    def of(self, name):
        return self.row[-1, SLICES[name]]


def node(folder, script, given=None):
    """What a script beside the page in ``folder`` prints as JSON; it reads what is ``given`` from its input."""
    need_program("node", "nodejs")
    (folder / "package.json").write_text('{"type": "module"}')
    (folder / "try.js").write_text(HEAD + script)
    done = subprocess.run(["node", "try.js"], cwd=folder, input=json.dumps(given), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def run(folder, *cases):
    """What a rig says after each step of each case, ("set" | "reset" | "hold" | "put" | "teach" | "advance" | "pass", value);
    of periods that pass only the last is told. ``folder`` holds the page."""

    def told(said):
        widths, texts = (ROWS, ROWS, COLUMNS, COLUMNS), said.pop("rows")
        return Told(*(np.frombuffer(base64.b64decode(t)).reshape(-1, n) for t, n in zip(texts, widths, strict=True)), **said)

    return [[told(one) for one in case] for case in node(folder, SCRIPT, cases)]
