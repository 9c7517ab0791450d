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
    const all = ["failed", "hello", "settings", "state", "path", "frame", "error"];
    this.connection = new Connection(Object.fromEntries(all.map((kind) => [kind, (message) => this.receive(kind, message)])));
    document.addEventListener("visibilitychange", () => this.connection.send({ type: "hidden", hidden: document.hidden }));
  }

  /** A message of the connection; while a recording plays it is only remembered. */
  receive(kind, message) {
    if (kind !== "frame" && kind !== "error") this.known.set(kind, message);
    const { replay } = this.known.get("hello") ?? {};
    if (kind === "hello" && replay) this.openServed(replay);
    else if (!this.player && !replay) this.handlers[kind](message);
  }

  /** Play the recording that this page was made for. */
  async openServed(name) {
    const answer = await fetch("rig/replay.rec");
    await this.open(new File([await answer.blob()], name));
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
      this.connection.send({ type: "device", on: false });
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
    for (const kind of ["path", "failed"]) if (known.has(kind)) handlers[kind](known.get(kind));
  }
}
