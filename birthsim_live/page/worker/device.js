// A Haply Inverse3 as the hand. Its service on this machine says in every message where the handle is, and sends the next one
// when it is told which force the handle shall make: 1000 times a second. Neither side is trusted: a person holds the handle.

import { forceFor, handleIn } from "./haply.js";

const ADDRESS = "ws://127.0.0.1:10001";
const NEEDS = "allowed: a running Haply Inverse Service";
const SHARE = 0.1; // of the rig's force: the device makes some 10 N, the rig 100 N
const MOST_FORCE = 10; // N, what the device bears
const MOST_STEP = 0.005; // m between two messages, so that a leap of the tracker is no blow: 5 m/s at 1000 Hz
const RISE = 500; // ms in which the force comes
const FALL = 200; // ms in which it goes
const LONG_STEP = 20; // ms; no more of the ramp passes between two messages, however long they are apart
const STALE = 100; // ms without a message that can be used; then the force goes
const GONE = 2000; // ms; then the device goes

/** A force, N, that the device bears: zero where it is no number. */
function bearable(force) {
  const size = Math.hypot(...force);
  if (!Number.isFinite(size)) return [0, 0];
  return force.map((value) => value * Math.min(1, MOST_FORCE / (size || 1)));
}

export class Device {
  /** `hub` takes the hand's messages; `ended(reason)` is told once, with words where something went wrong. */
  constructor(hub, ended) {
    const now = performance.now();
    Object.assign(this, { hub, ended, id: null, first: null, moved: [0, 0], gain: 0, heard: now, stepped: now, leaving: null });
    this.ignored = { count: 0, why: null }; // messages that say nothing
    this.socket = new WebSocket(ADDRESS);
    this.socket.addEventListener("message", ({ data }) => this.receive(data));
    this.socket.addEventListener("close", () => this.close(`device = ${ADDRESS} ${this.id === null ? "does not answer" : "has gone"}; ${NEEDS}`));
  }

  receive(data) {
    if (this.over) return;
    try {
      this.move(handleIn(data, this.id));
      this.heard = performance.now();
    } catch ({ message }) {
      this.ignored = { count: this.ignored.count + 1, why: message };
    }
    this.answer(performance.now());
  }

  /** The handle has moved since it was first seen; so far does the hand move from where the head was then. */
  move({ id, x, z }) {
    this.id = id;
    const { session, clock } = this.hub;
    const head = session.some("x", 2);
    if (!head.every(Number.isFinite)) return; // a rig that is lost: there is nothing to hold
    this.first ??= { x, z, head };
    const way = [x - this.first.x - this.moved[0], z - this.first.z - this.moved[1]];
    const share = Math.min(1, MOST_STEP / (Math.hypot(...way) || 1));
    this.moved = this.moved.map((value, k) => value + share * way[k]);
    this.hub.on_drag({ position: this.moved.map((value, k) => this.first.head[k] + value) });
    clock.catchUp();
  }

  /** Called now and then, too: a service that says nothing more is told to let its force go. */
  watch() {
    const now = performance.now();
    if (now - this.heard > GONE) this.close(`device = ${ADDRESS} ${this.ignored.why ? `says ${this.ignored.why}` : `says nothing; ${NEEDS}`}`);
    else if (this.leaving || now - this.heard > STALE) this.answer(now);
  }

  /** Tell the device its force. */
  answer(now) {
    this.ramp(now);
    if (this.id !== null) this.socket.send(forceFor(this.id, this.force()));
    if (this.leaving && this.gain === 0) this.close(this.leaving.reason);
  }

  /** The force comes by and by, and goes so where the rig, its clock, the page or the device is not there. */
  ramp(now) {
    const { session, clock, hidden } = this.hub;
    const there = !(session.halted || clock.paused || hidden || this.leaving || now - this.heard > STALE);
    const passed = Math.min(now - this.stepped, LONG_STEP);
    this.stepped = now;
    this.gain = there ? Math.min(1, this.gain + passed / RISE) : Math.max(0, this.gain - passed / FALL);
  }

  force() {
    const felt = bearable(this.hub.session.some("pointer_force_x", 2).map((value) => -SHARE * value));
    return felt.map((value) => this.gain * value + 0); // no negative zero
  }

  /** It is wanted after all. */
  stay() {
    this.leaving = null;
  }

  /** Let go of the head, by and by; `reason` is why, or nothing where a person wants it. */
  end(reason) {
    this.leaving ??= { reason };
    if (this.id === null) this.close(reason);
  }

  close(reason) {
    if (this.over) return;
    this.over = true;
    if (this.id !== null) this.socket.send(forceFor(this.id, [0, 0])); // to a socket that is closed this does nothing
    this.hub.on_release();
    this.socket.close();
    this.ended(reason);
  }
}
