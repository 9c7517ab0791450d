// The way that a point has come in the last seconds, fading.

import { finite } from "./pen.js";

const SPAN = 2; // s
const LEAP = 0.5; // s; a gap in time is no way
const BANDS = 8; // shades

export class Trail {
  constructor() {
    this.clear();
  }

  clear() {
    this.points = []; // { time, point }, oldest first
  }

  /** Add a point, m; a time that runs back or leaps begins anew. */
  push(time, point) {
    const newest = this.points.at(-1)?.time ?? time;
    if (time < newest || time > newest + LEAP) this.clear();
    this.points.push({ time, point: [...point] });
    while (this.points[0].time < time - SPAN) this.points.shift();
  }

  /** How wide, m, a window must be to hold a share of its points: `rooms` are shares of its width, beside the middle and above. */
  reach(share, rooms) {
    const far = this.points.flatMap(({ point }) => (finite(point) ? [Math.max(...point.map((value, k) => Math.abs(value) / rooms[k]))] : []));
    return far.sort((a, b) => a - b)[Math.floor(share * far.length)] ?? 0;
  }

  /** Draw it with a pen, the older the fainter; `origin`, m, is added to every point. */
  draw(pen, colour, px, origin = [0, 0]) {
    const { points } = this;
    if (points.length < 2) return;
    const newest = points.at(-1).time;
    const placed = points.map(({ point }) => (finite(point) ? [point[0] + origin[0], point[1] + origin[1]] : point));
    const { context } = pen;
    context.save();
    for (let band = 0; band < BANDS; band += 1) {
      const [oldest, youngest] = [1 - band / BANDS, 1 - (band + 1) / BANDS].map((age) => newest - SPAN * age);
      const first = points.findIndex(({ time }) => time >= oldest);
      const last = points.findLastIndex(({ time }) => time <= youngest);
      if (first < 0 || last < first) continue;
      context.globalAlpha = (band + 1) / BANDS;
      pen.line(placed.slice(first, last + 2), colour, px);
    }
    context.restore();
  }
}
