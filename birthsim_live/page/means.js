// What is written of a rig: means over a quarter of a second, so that every place that writes a number has the same one.

const SPAN = 250; // ms
const POINTS = ["force", "position", "target", "compliant"];

export class Means {
  constructor() {
    this.clear();
  }

  clear() {
    this.frames = [];
    this.shown = []; // of rig 0 and 1: { time, force, position, target, compliant, error_mm }
    this.begun = -Infinity;
  }

  /** Take note of a frame. Where time stands still or runs back, that instant itself is what is shown. */
  push(frame, now = performance.now()) {
    if (!(frame.time > this.time)) {
      this.frames = [];
      this.begun = -Infinity;
    }
    this.time = frame.time;
    this.frames.push(frame);
    if (now < this.begun + SPAN) return;
    this.begun = now;
    this.shown = [mean(this.frames), frame.second && mean(this.frames.map(({ second }) => second).filter(Boolean))];
    this.frames = [];
  }
}

/** Of several instants. */
export function mean(frames) {
  const over = (value) => frames.reduce((sum, frame) => sum + value(frame), 0) / frames.length;
  const points = POINTS.map((name) => [name, [0, 1].map((k) => over((frame) => frame[name][k]))]);
  return { ...Object.fromEntries(points), time: frames.at(-1).time, error_mm: over(({ error_mm: error }) => error) };
}
