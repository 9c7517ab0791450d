// The stiffness at the end effector in every direction: an ellipse for what is asked for, a dot for what the hand feels.

import { LEAST_FORCE, LEAST_GIVEN } from "../frame.js";
import * as pen from "../pen.js";
import { Pen } from "../pen.js";
import { Trail } from "../trail.js";

const ROOM = 1.4; // so many times the larger stiffness is shown
const MARGIN = 3; // px

/**
 * Force over displacement as a vector, N/m, or null where there is hardly any of them. For a stiffness K the vectors of all
 * directions are the ellipse of K u, u a unit vector: along x it reaches Kx, along y Ky.
 */
export function feltVector({ force, position, target }) {
  const given = Math.hypot(position[0] - target[0], position[1] - target[1]);
  if (!(Math.hypot(...force) >= LEAST_FORCE && given >= LEAST_GIVEN)) return null;
  return force.map((value) => value / given);
}

export class Ellipse {
  constructor() {
    this.trail = new Trail();
  }

  push(frame) {
    this.trail.push(frame.time, feltVector(frame) ?? [NaN, NaN]);
  }

  draw(context, width, height, frame) {
    const [kx, ky] = frame.stiffness;
    const scale = (Math.min(width, height) / 2 - MARGIN) / (ROOM * Math.max(kx, ky));
    if (!Number.isFinite(scale)) return;
    const world = new Pen(context, [width / 2, height / 2], scale);
    const far = Math.max(width, height) / scale;
    world.line([[-far, 0], [far, 0]], pen.GRID);
    world.line([[0, -far], [0, far]], pen.GRID);
    const round = Array.from({ length: 73 }, (_, k) => [kx * Math.cos((k * Math.PI) / 36), ky * Math.sin((k * Math.PI) / 36)]);
    world.line(round, pen.TARGET, 2);
    world.text(kx.toFixed(0), [width / 2 + scale * kx + 4, height / 2 + 11], { align: "left", size: 11, weight: 500 });
    world.text(ky.toFixed(0), [width / 2 + 5, height / 2 - scale * ky - 9], { align: "left", size: 11, weight: 500 });
    world.text("x", [width - 6, height / 2 - 8], { size: 11, weight: 500 });
    world.text("y", [width / 2 - 8, 8], { size: 11, weight: 500 });
    this.trail.draw(world, pen.GREY, 1.5);
    const felt = feltVector(frame);
    if (!felt) return;
    const size = Math.hypot(...felt);
    const shown = Math.min(1, (ROOM * Math.max(kx, ky)) / size); // what is further out is shown at the rim
    const at = felt.map((value) => shown * value);
    world.line([[0, 0], at], pen.INK, 1);
    world.disc(at, 4.5, pen.END_EFFECTOR, pen.PAPER, 1);
  }
}
