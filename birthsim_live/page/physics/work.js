// What goes through the port between hand and rig: power now, and the hand's work since it took hold.

const LEAST_FORCE = 0.05; // N; below it nobody holds the head
const LEAP = 0.5; // s; a gap in time begins anew

export class Work {
  constructor() {
    this.last = null;
    this.done = 0; // J
  }

  /** Add a frame: mean force times the way since the frame before, which is exact where force is linear in place. */
  push({ time, force, position }) {
    const held = Math.hypot(...force) >= LEAST_FORCE;
    const { last } = this;
    const goes = last && time >= last.time && time - last.time < LEAP;
    if (!goes || (held && !last.held)) this.done = 0;
    if (goes && (held || last.held)) {
      const added = force.reduce((sum, value, k) => sum + 0.5 * (value + last.force[k]) * (position[k] - last.position[k]), 0);
      if (Number.isFinite(added)) this.done += added;
    }
    this.last = { time, held, force, position };
  }

  /** Power of the hand, W; its work, J; what of it the spring that is asked for would store now, J; and the rest, J. */
  figures({ force, velocity, target, compliant }) {
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1];
    const stored = 0.5 * dot(force, [compliant[0] - target[0], compliant[1] - target[1]]);
    return { power: dot(force, velocity), work: this.done, stored, rest: this.done - stored };
  }
}
