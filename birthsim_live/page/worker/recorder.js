// Takes a session down and makes the file that birthsim live --replay plays (birthsim_live/logs/recording.py has the format).

import { crc32 } from "../crc32.js";
import { NO_ROW, rowOf } from "./frames.js";

const ROWS = 512; // in a chunk

/** A chunk that says `said` and holds `rows`. */
async function packed(said, rows) {
  const raw = new Blob([`${JSON.stringify(said)}\n`, ...rows]);
  const content = new Uint8Array(await new Response(raw.stream().pipeThrough(new CompressionStream("deflate"))).arrayBuffer());
  const head = new DataView(new ArrayBuffer(8));
  head.setUint32(0, content.length, true);
  head.setUint32(4, crc32(content), true);
  return [head.buffer, content];
}

export class Recorder {
  constructor(session, name) {
    const { every, longest } = session.numbers;
    Object.assign(this, { name, every, longest, interval: every * session.period, header: session.pack.header });
    this.rows = [];
    this.events = [];
    this.known = { second_lost: "null" };
    this.paths = -1;
    this.periods = 0;
    this.take(session);
  }

  get seconds() {
    return this.rows.length * this.interval;
  }

  get full() {
    return this.seconds >= this.longest;
  }

  /** Take note of the present control period. */
  take(session) {
    if (this.periods % this.every === 0 && !this.full) {
      this.note("settings", session.shownSettings());
      if (this.paths !== session.paths) this.note("path", session.path());
      this.paths = session.paths;
      this.note("lost", session.lost);
      this.note("second_lost", session.second?.lost ?? null);
      this.rows.push(new Float64Array([...rowOf(session), ...(session.second ? rowOf(session.second) : NO_ROW)]));
    }
    this.periods += 1;
  }

  note(kind, value) {
    const words = JSON.stringify(value);
    if (this.known[kind] === words) return;
    this.known[kind] = words;
    this.events.push({ row: this.rows.length, [kind]: value });
  }

  /** The file. */
  async file() {
    const pieces = await packed(this.header, []);
    for (let first = 0; first < this.rows.length; first += ROWS) {
      const events = this.events.filter(({ row }) => row >= first && row < first + ROWS);
      pieces.push(...(await packed({ events }, this.rows.slice(first, first + ROWS))));
    }
    return new Blob(pieces, { type: "application/octet-stream" });
  }
}
