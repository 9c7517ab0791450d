// The rigs in their pictures: one, or two beside each other under one hand.

import { Drag } from "./drag.js";
import { stiffness } from "./readouts.js";
import { Scene } from "./scene.js";

const RATE = 8; // updates of the captions per second: faster, digits cannot be read
const SPAN = 2; // s of the running root mean square

const SIDES = [
  { place: "rig", error: "error" },
  { place: "second-rig", error: "second_error" },
];

const digits = (value, places) => (Number.isFinite(value) ? value.toFixed(places) : "–");

export class Rigs {
  /** `hand` is this window's; `frame()` is the newest frame, `enabled()` says whether there is a rig to hold. */
  constructor(hand, history, { frame, enabled }) {
    this.hand = hand;
    this.history = history;
    this.last = 0;
    this.frames = [() => frame(), () => frame()?.second];
    this.scenes = SIDES.map(({ place }, k) => {
      const canvas = document.getElementById(place);
      const scene = new Scene(canvas, { magnified: k === 0 });
      new Drag(canvas, { scene, hand, enabled, frame: this.frames[k] });
      return scene;
    });
    this.captions = SIDES.map(({ place }) => [...document.getElementById(place).parentElement.querySelectorAll("b, i")]);
  }

  setUp({ geometry, air, choices }) {
    this.titles = Object.fromEntries(choices.controller.map(({ name, title }) => [name, title]));
    for (const scene of this.scenes) scene.setUp(geometry, air);
  }

  setPath(points) {
    for (const scene of this.scenes) scene.setPath(points);
  }

  /** The names of both. */
  show({ controller, compare }) {
    [controller, compare].forEach((name, k) => this.write(k, 0, this.titles[name] ?? name));
  }

  /** The hint of what to do has been followed. */
  cued() {
    for (const scene of this.scenes) scene.cue = false;
  }

  draw(frame) {
    const two = frame.second ? "2" : "1";
    if (document.body.dataset.rigs !== two) document.body.dataset.rigs = two;
    this.scenes[0].draw(frame, this.hand.held);
    if (frame.second) this.scenes[1].draw(frame.second, this.hand.held);
  }

  /** Called with each frame of the screen: the captions of two. */
  step(frame, now) {
    if (!frame.second || now - this.last < 1e3 / RATE) return;
    this.last = now;
    [frame, frame.second].forEach((one, k) => {
      this.write(k, 1, digits(one.error_mm, 2));
      this.write(k, 2, digits(this.running(SIDES[k].error), 2));
      const felt = stiffness(one);
      this.write(k, 3, felt ? Number(felt[0].toPrecision(3)).toLocaleString("en") : "–");
    });
  }

  write(side, part, words) {
    const element = this.captions[side][part];
    if (element.textContent !== words) element.textContent = words;
  }

  /** Root mean square of a series over the last seconds. */
  running(name) {
    const times = this.history.view("time");
    const first = times.findIndex((time) => time >= this.history.newest - SPAN);
    const values = this.history.view(name).subarray(Math.max(first, 0)).filter(Number.isFinite);
    return Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / values.length);
  }
}
