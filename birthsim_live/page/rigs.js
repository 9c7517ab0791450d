// The rigs in their pictures: one, or two beside each other under one hand.

import { Drag } from "./drag.js";
import { stiffness } from "./readouts.js";
import { RunningRms } from "./rms.js";
import { Scene } from "./scene.js";
import { formula } from "./symbols.js";

const PLACES = ["rig", "second-rig"];
const CURVES = ["error", "second_error"];
const NOTHING = "nothing"; // to compare with

const digits = (value, places) => (Number.isFinite(value) ? value.toFixed(places) : "–");

export class Rigs {
  /** `hand` is this window's; `frame()` is the newest frame, `enabled()` says whether there is a rig to hold. */
  constructor(hand, { frame, enabled }) {
    this.hand = hand;
    this.last = null;
    this.chosen = 0;
    this.rms = PLACES.map(() => new RunningRms());
    const canvases = PLACES.map((place) => document.getElementById(place));
    const frames = [() => frame(), () => frame()?.second];
    this.scenes = canvases.map((canvas, k) => {
      const scene = new Scene(canvas, { cue: k === 0 });
      new Drag(canvas, { scene, hand, enabled, frame: frames[k] });
      return scene;
    });
    const figures = canvases.map((canvas) => canvas.parentElement);
    this.captions = figures.map((figure) => [...figure.querySelectorAll("b, i")]);
    this.choices = figures.map((figure) => figure.querySelector("input"));
    this.of = document.getElementById("of");
    this.choices.forEach((choice, k) => choice.addEventListener("change", () => this.choose(k)));
  }

  setUp(hello) {
    this.titles = Object.fromEntries(hello.choices.controller.map(({ name, title }) => [name, title]));
    for (const scene of this.scenes) scene.setUp(hello);
    this.clear();
  }

  /** Forget the past. */
  clear() {
    for (const rms of this.rms) rms.clear();
  }

  setPath(points) {
    for (const scene of this.scenes) scene.setPath(points);
  }

  /** The names of both, above the pictures and in the plot of the error. */
  show({ controller = "", compare = NOTHING, Kclx = Infinity, Kcly = Infinity }) {
    for (const scene of this.scenes) scene.setStiffness(Kclx, Kcly);
    const names = [controller, compare].map((name) => this.titles[name] ?? name);
    names.forEach((name, k) => this.write(k, 0, name));
    this.choose(compare === NOTHING ? 0 : this.chosen);
    CURVES.forEach((curve, k) => {
      const parts = compare === NOTHING ? [["e"]] : [names[k]];
      document.querySelector(`[data-curve=${curve}] .symbol`).replaceWith(formula(parts));
    });
  }

  /** Take note of a frame. */
  push(frame) {
    this.note(frame);
    this.scenes[0].push(frame);
    if (frame.second) this.scenes[1].push(frame.second);
  }

  /** Take note of what a frame adds to the running errors. */
  note({ time, error_mm: error, second }) {
    this.rms[0].push(time, error);
    this.rms[1].push(time, second?.error_mm ?? NaN);
  }

  /** Choose the rig that numbers, physics and plots show. */
  choose(k) {
    this.chosen = k;
    this.choices[k].checked = true;
    this.of.textContent = this.captions[k][0].textContent;
  }

  /** What a frame shows of the rig that is chosen. */
  rigOf(frame) {
    return (this.chosen && frame.second) || frame;
  }

  /** The hint of what to do has been followed. */
  cued() {
    for (const scene of this.scenes) scene.cue = false;
  }

  /** `lens` is what the lens shows: its `window`, m, and its canvas; `means` are what is written of the rigs (means.js). */
  draw(frame, lens, means) {
    const two = frame.second ? "2" : "1";
    if (document.body.dataset.rigs !== two) document.body.dataset.rigs = two;
    const [first, second] = this.scenes;
    first.draw(frame, { held: this.hand.held, lens, ghost: second.hidden ? frame.second : null, mean: means[0] });
    if (frame.second) second.draw(frame.second, { held: this.hand.held, lens, ghost: null, mean: means[1] });
  }

  /** Called with each frame of the screen: the captions of two from their means (means.js); `rms` are running errors, mm. */
  step(means, rms) {
    if (!means[1] || means === this.last) return;
    this.last = means;
    means.forEach((one, k) => {
      this.write(k, 1, digits(one.error_mm, 2));
      this.write(k, 2, digits(rms[k], 2));
      const felt = stiffness(one);
      this.write(k, 3, felt ? Number(felt[0].toPrecision(3)).toLocaleString("en") : "–");
    });
  }

  write(side, part, words) {
    const element = this.captions[side][part];
    if (element.textContent !== words) element.textContent = words;
  }
}
