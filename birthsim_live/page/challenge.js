// A challenge: pull with some force, and keep the head where a spring would hold it for some seconds.

const PULL = 20; // N
const WITHIN = 1; // mm
const LONG = 5; // s

export class Challenge {
  constructor() {
    this.bar = document.getElementById("held");
    this.words = document.getElementById("challenge");
    this.clear();
  }

  clear() {
    Object.assign(this, { since: null, held: 0, done: false });
  }

  /** Take note of a frame; `held`, s, is how long the head has stayed within the limit. */
  push({ time, force, error_mm: error }) {
    const fits = Math.hypot(...force) >= PULL && error <= WITHIN;
    this.since = fits ? Math.min(this.since ?? time, time) : null;
    this.held = fits ? time - this.since : 0;
    this.done ||= this.held >= LONG;
    const words = this.done ? "done" : `${this.held.toFixed(1)} s`;
    if (words === this.words.textContent) return;
    this.words.textContent = words;
    this.bar.value = this.done ? LONG : this.held;
  }
}
