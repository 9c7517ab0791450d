// Plays a recording, with the face of a connection.

import { FIELDS, frameOf } from "../frame.js";
import { checkedMessage } from "../worker/messages.js";

const MOST = 1500; // frames for the plots of a whole recording
const MESSAGES = ["pause", "speed", "seek"]; // of the others, such as those of a hand, a recording takes no notice
const NUMBERS = { slowest: 0.01 };
const NONE = { settings: {}, path: [], lost: null, second_lost: null };

export class Player {
  /** `hello` is the greeting of the page's own rig, whose shape is drawn; `handlers` are those of a connection. */
  constructor(recording, hello, handlers) {
    Object.assign(this, { recording, hello, handlers, position: 0, paused: false, speed: 1, frames: 0 });
    this.told = {};
  }

  start() {
    this.last = performance.now();
    const { settings, state } = this.news();
    this.handlers.hello({ ...this.hello, mode: "replay", settings: settings.settings, state });
    this.handlers.history({ frames: this.whole() });
    this.step(this.last);
  }

  stop() {
    cancelAnimationFrame(this.due);
  }

  send(message) {
    if (!MESSAGES.includes(message.type)) return true;
    const { type, paused, speed, time } = checkedMessage(message, MESSAGES, this.hello, NUMBERS);
    if (type === "pause") {
      if (!paused && this.ended) this.position = 0;
      this.paused = paused;
    } else if (type === "speed") this.speed = speed;
    else if (type === "seek") this.position = Math.min(Math.max(time, 0), this.recording.duration);
    return true;
  }

  get ended() {
    return this.position >= this.recording.duration;
  }

  step(now) {
    this.due = requestAnimationFrame((next) => this.step(next));
    const passed = (now - this.last) / 1e3;
    this.last = now;
    const running = !this.paused && !this.ended;
    if (running) this.position = Math.min(this.position + Math.max(passed, 0) * this.speed, this.recording.duration);
    for (const [kind, message] of Object.entries(this.news())) {
      const words = JSON.stringify(message);
      if (this.told[kind] !== words) this.handlers[kind](message);
      this.told[kind] = words;
    }
    this.frames += 1;
    this.handlers.frame({ ...this.frame(), n: this.frames, real_time: running ? 1 : null, behind: 0 });
  }

  news() {
    const { name, duration } = this.recording;
    const state = { paused: this.paused || this.ended, speed: this.speed, recording: null, last_recording: null, dragging: false, duration, file: name };
    return { settings: { settings: this.event("settings") }, state, path: { points: this.event("path") } };
  }

  /** What was last noted of a kind at the present row. */
  event(kind) {
    const row = Math.floor(this.place());
    const found = this.recording.events.findLast((event) => kind in event && event.row <= row);
    return found ? found[kind] : NONE[kind];
  }

  place() {
    return this.position / this.recording.interval + 1e-6;
  }

  /** The present instant, between two rows on a straight line. */
  frame() {
    const { rows, width } = this.recording;
    const place = this.place();
    const first = Math.floor(place) * width;
    const part = place % 1;
    const here = rows.subarray(first, first + width);
    const there = first + width < rows.length ? rows.subarray(first + width, first + 2 * width) : here;
    const row = part > 1e-5 ? here.map((value, k) => value + part * (there[k] - value)) : here;
    const frame = this.named(row, this.position);
    const told = (kind) => ({ pointer_id: null, lost: this.event(kind) });
    return { ...frame, ...told("lost"), second: frame.second && { ...frame.second, ...told("second_lost") } };
  }

  /** A row as a frame at a time of the recording, s; `second` is the rig beside it, or null. */
  named(row, time) {
    const { rigs, width } = this.recording;
    const second = rigs === 2 ? this.one(row.subarray(width / 2), time) : null;
    return { ...this.one(row, time), second: Number.isFinite(second?.episode_time) ? second : null };
  }

  /** The numbers of one rig. */
  one(row, time) {
    let place = 0;
    const now = Object.fromEntries(Object.entries(FIELDS).map(([name, size]) => {
      const held = this.recording.columns.includes(name);
      const values = held ? Array.from(row.subarray(place, place + size)) : new Array(size).fill(NaN);
      if (held) place += size;
      return [name, values];
    }));
    return frameOf({ ...now, time: [time] }, this.hello.geometry);
  }

  whole() {
    const { rows, width, interval } = this.recording;
    const count = rows.length / width;
    const step = Math.ceil(count / MOST);
    const frames = [];
    for (let k = 0; k < count; k += step) frames.push(this.named(rows.subarray(k * width, (k + 1) * width), k * interval));
    return frames;
  }
}

/** Whether the page can draw the rig of a recording: it has the shape of its own rig. */
export function isDrawn({ header: { rig } }, { geometry, guide, cylinders }) {
  const rail = rig.linkage?.kind === "rail" && (rig.linkage.inclination ?? 0);
  if ((rail === false) !== (guide === null) || (guide && Math.abs(Math.sin(rail) - guide[1]) > 1e-9)) return false;
  const names = guide ? ["d3", "d6", "k2"] : ["d3", "d6", "k1", "k2", "gamma3"]; // k1 and gamma3 of a rail follow from the others
  const own = names.every((name) => Math.abs(rig.geometry[name] - geometry[name]) < 1e-9);
  return own && cylinders.every((k) => Math.abs(rig[`cylinder${k + 1}`]?.stroke / 2 - geometry[`half_stroke${k + 1}`]) < 1e-9);
}
