// Where the page's rig comes from: the connection, or a recording that somebody opened here.

import { Connection } from "./connection.js";
import { Player, isDrawn } from "./replay/player.js";
import { readRecording } from "./replay/file.js";

export class Source {
  /** `handlers` as of a connection. */
  constructor(handlers) {
    this.handlers = handlers;
    this.player = null;
    this.known = new Map();
    const all = ["closed", "failed", "hello", "history", "settings", "state", "path", "frame", "error"];
    this.connection = new Connection(Object.fromEntries(all.map((kind) => [kind, (message) => this.receive(kind, message)])));
  }

  /** A message of the connection; while a recording plays it is only remembered. */
  receive(kind, message) {
    if (kind === "hello") this.known.clear();
    if (kind !== "frame" && kind !== "error") this.known.set(kind, message);
    if (!this.player) this.handlers[kind](message);
  }

  send(message) {
    return this.player ? this.player.send(message) : this.connection.send(message);
  }

  /** Where the recording `name` can be saved from. */
  address(name) {
    return this.connection.address(name);
  }

  /** Play a file in place of the rig, which goes on without being seen. */
  async open(file) {
    try {
      const recording = await readRecording(file);
      const hello = this.known.get("hello");
      if (!hello) throw new Error("no rig is here yet to draw a recording with; allowed: once one is");
      if (!isDrawn(recording, hello)) throw new Error(`recording = '${file.name}' is of a rig of another shape; allowed: birthsim live --replay FILE`);
      this.connection.send({ type: "release" });
      this.player?.stop();
      this.player = new Player(recording, hello, this.handlers);
      this.player.start();
    } catch (error) {
      this.handlers.error(error);
    }
  }

  /** Back to the rig. */
  close() {
    this.player.stop();
    this.player = null;
    const { known, handlers } = this;
    const hello = known.get("hello");
    handlers.hello({ ...hello, settings: known.get("settings")?.settings ?? hello.settings, state: known.get("state") ?? hello.state });
    // What a rig did before is older than what it has done meanwhile; what a recording holds is not.
    const kept = ["path", ...(hello.mode === "replay" ? ["history"] : []), "closed", "failed"];
    for (const kind of kept) if (known.has(kind)) handlers[kind](known.get(kind));
  }
}
