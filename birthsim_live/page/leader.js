// What the lens shows of the main view, the lines from there to the lens, and the room that the lens has.

import { CAP, finite } from "./pen.js";

const MARGIN = 20; // px between the lens and the head's path
const MEASURED = 500; // ms between looks at where the lens is

export class Leader {
  constructor(canvas) {
    this.canvas = canvas;
    this.place = { at: -Infinity };
  }

  /** Say how large a lens above the head's `path` may be, px. */
  leaveRoom(pen, path, head) {
    const highest = Math.max(...path.map(([, y]) => y)) + head.radius;
    const room = pen.pixel([0, highest])[1] - MARGIN;
    if (Number.isFinite(room)) this.canvas.closest(".view").style.setProperty("--lens", `${Math.round(room)}px`);
  }

  /** `centre` is the middle of what the `lens`, a magnifier, shows. */
  draw(pen, centre, lens) {
    const small = Math.max((lens.window / 2) * pen.scale, 2);
    pen.disc(centre, small, null, CAP, 1);
    const now = performance.now();
    if (now > this.place.at + MEASURED) this.place = { at: now, ...this.placeOf(lens.sheet.canvas) };
    const { x, y, radius } = this.place;
    if (!radius || !finite(centre)) return;
    const from = pen.pixel(centre);
    const [dx, dy] = [x - from[0], y - from[1]];
    const far = Math.hypot(dx, dy);
    if (far < 1.1 * (radius + small)) return;
    const { context } = pen;
    Object.assign(context, { strokeStyle: CAP, lineWidth: 1 });
    for (const side of [-1, 1]) {
      const turn = Math.atan2(dy, dx) + side * Math.acos((small - radius) / far);
      const [ux, uy] = [Math.cos(turn), Math.sin(turn)];
      context.beginPath();
      context.moveTo(from[0] + small * ux, from[1] + small * uy);
      context.lineTo(x + radius * ux, y + radius * uy);
      context.stroke();
    }
  }

  /** Middle and radius, px, of a round canvas that lies on this one; nothing of one that lies elsewhere. */
  placeOf(canvas) {
    const [own, its] = [this.canvas, canvas].map((one) => one.getBoundingClientRect());
    const [x, y] = [(its.left + its.right) / 2 - own.left, (its.top + its.bottom) / 2 - own.top];
    return x > 0 && x < own.width && y > 0 && y < own.height ? { x, y, radius: its.width / 2 } : {};
  }
}
