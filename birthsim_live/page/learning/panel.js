// A controller that learns while somebody looks on: a button, its error as it falls, and the rig, which it moves at once.

import * as pen from "../pen.js";
import { Sheet } from "../sheet.js";
import { LEARNING } from "../worker/settings.js";

const ALONE = { scenario: "probe", scenario_force: false }; // the visitor's hand and no other
const RANGE = [0.1, 100]; // mm, on a logarithmic scale
const SMOOTH = 9; // updates of which a median is shown

const written = (value) => (Number.isFinite(value) ? value.toFixed(1) : "–");

export class Learning {
  /** `send` tells the rig what has been learned, `change` asks it for settings, `tell` says what fails. */
  constructor({ send, change, tell }) {
    Object.assign(this, { send, change, tell, wanted: false, paused: false, worker: null, share: 0, seconds: 0, errors: [], settings: {} });
    const [place, button, words, choice, canvas] = ["learning", "learn", "learned", "choose-learned", "learning-curve"].map((id) => document.getElementById(id));
    Object.assign(this, { place, button, words, choice });
    this.sheet = new Sheet(canvas, { changed: () => this.sheet && this.draw() });
    button.addEventListener("click", () => this.press());
    document.addEventListener("visibilitychange", () => this.go());
    pen.onNightfall(() => this.draw());
  }

  get done() {
    return this.share === 1;
  }

  press() {
    if (this.done) this.change(ALONE);
    else this.wanted = !this.wanted;
    this.go();
  }

  /** Take note of settings; none where there is no rig to move. */
  show(settings) {
    this.settings = settings;
    this.place.hidden = settings.controller !== LEARNING;
    this.choice.hidden &&= this.place.hidden;
    this.go();
  }

  /** It rests while the rig does, such as out of sight in a long page. */
  pause(paused) {
    this.paused = paused;
    this.go();
  }

  /** Learn where that is wanted and seen. */
  go() {
    const on = this.wanted && !this.paused && !this.place.hidden && !document.hidden;
    if (on) this.worker ??= this.begin();
    this.worker?.postMessage({ on });
    this.write();
  }

  begin() {
    const worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
    worker.addEventListener("message", ({ data }) => (data.failed ? this.fail(data.failed) : this.push(data)));
    worker.addEventListener("error", ({ message }) => this.fail(message || "its program cannot be loaded"));
    return worker;
  }

  fail(reason) {
    this.wanted = false;
    this.write();
    this.tell(`Nothing can be learned here: ${reason}`);
  }

  /** Take note of news: `errors` of the updates since the last ones, mm, `share` of all that is done, and the `network`. */
  push({ errors, seconds, share, network }) {
    Object.assign(this, { seconds, share });
    this.errors.push(...errors);
    if (!this.place.hidden) this.send({ type: "learned", network });
    this.write();
    this.draw();
  }

  write() {
    const { done, wanted, errors, button, words } = this;
    button.textContent = done ? "Pull it yourself" : wanted ? "Stop" : errors.length ? "Go on" : "Learn it here";
    button.disabled = done && Object.entries(ALONE).every(([name, value]) => this.settings[name] === value);
    words.setAttribute("aria-live", done ? "polite" : "off"); // else screen readers would never end
    const now = `${this.seconds.toFixed(0)} s on 32 rigs at once: off by ${written(this.last())} mm`;
    const begun = errors.length ? `${now}.` : "Nothing learned yet: the valves stay shut.";
    words.textContent = done ? `Learned in ${now}. Pull the head: it gives way as a spring does.` : begun;
  }

  /** Median of the last errors up to number `end`, mm. */
  last(end = this.errors.length) {
    const some = this.errors.slice(Math.max(0, end - SMOOTH), end).sort((a, b) => a - b);
    return some[Math.floor(some.length / 2)] ?? NaN;
  }

  draw() {
    const { context, width, height } = this.sheet;
    if (!width) return;
    const [low, high] = RANGE.map(Math.log10);
    const at = (value) => (height - 1) * ((high - Math.log10(Math.min(Math.max(value, RANGE[0]), RANGE[1]))) / (high - low));
    context.clearRect(0, 0, width, height);
    const flat = new pen.Pen(context, [0, 0], 1);
    for (const value of [10, 1]) {
      flat.line([[0, -at(value)], [width, -at(value)]], pen.FAINT);
      flat.text(`${value} mm`, [width - 2, at(value) - 8], { align: "right", size: 11, weight: 500 });
    }
    const total = this.errors.length / (this.share || 1);
    flat.line(this.errors.map((_, k) => [(width * (k + 1)) / total, -at(this.last(k + 1))]), pen.FORCE, 1.8);
  }
}
