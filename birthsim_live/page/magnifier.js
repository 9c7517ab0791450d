// The lens: the error, large. The end effector is seen from the compliant target, which stands in the middle.
// Two rigs share the picture: each head is seen from its own compliant target, so that their errors can be compared.

import * as pen from "./pen.js";
import { Axis, Pen, finite, widthOf } from "./pen.js";
import { Sheet } from "./sheet.js";
import { Trail } from "./trail.js";

const WINDOWS = [0.01, 0.02, 0.04, 0.08, 0.16]; // widths the lens may show, m
const EDGE = 0.42; // of the width: so far beside the middle is the end effector still well inside
const SMALL = 150; // px; a lens that is smaller has no room for the errors of two rigs
const MOST = 0.8; // of the errors
const RIM = 3; // px

const rigsOf = (frame) => (frame.second ? [frame, frame.second] : [frame]);
const errorOf = ({ position, compliant }) => [0, 1].map((k) => position[k] - compliant[k]);

export class Magnifier {
  /** `heading` is the element that says how many times larger the picture is. */
  constructor(canvas, heading) {
    this.heading = heading;
    this.path = [];
    this.times = "";
    this.window = WINDOWS[0];
    this.trails = [new Trail(), new Trail()];
    this.sheet = new Sheet(canvas);
  }

  setPath(points) {
    this.path = points;
  }

  /** Take note of a frame: the trails hold errors, m. */
  push(frame) {
    rigsOf(frame).forEach((one, k) => this.trails[k].push(frame.time, errorOf(one)));
  }

  /** The window holds most errors of as long as the trail lasts, clear of the words: a jump of the hand leaves it, and comes back. */
  fit(frame) {
    const { height } = this.sheet;
    const { foot } = this.errorsOf(frame, []);
    const rooms = [EDGE, height ? Math.min(EDGE, 0.5 - foot / height) : EDGE];
    const least = Math.max(...rigsOf(frame).map((_, k) => this.trails[k].reach(MOST, rooms)));
    this.window = WINDOWS.find((window) => least <= window) ?? WINDOWS.at(-1);
  }

  /** `mainScale` is that of the main view, px/m; `means` are what is written of the rigs (means.js). */
  draw(frame, mainScale, means) {
    this.sheet.check();
    this.fit(frame);
    const { width, height, context } = this.sheet;
    if (!width) return;
    context.clearRect(0, 0, width, height);
    context.save();
    const round = () => {
      context.beginPath();
      context.arc(width / 2, height / 2, Math.min(width, height) / 2 - RIM / 2, 0, 2 * Math.PI);
    };
    round();
    context.clip();
    this.drawInside(frame, mainScale, means);
    context.restore();
    round();
    Object.assign(context, { strokeStyle: pen.CAP, lineWidth: RIM });
    context.stroke();
  }

  drawInside(frame, mainScale, means) {
    const { width, height, context } = this.sheet;
    const { target, compliant, position, second } = frame;
    const { window } = this;
    const centre = [compliant, position, target].find(finite) ?? [0, 0];
    const scale = Math.min(width, height) / window;
    const world = new Pen(context, [width / 2 - scale * centre[0], height / 2 + scale * centre[1]], scale);
    const step = window / 4;
    context.fillStyle = pen.SHEET;
    context.fillRect(0, 0, width, height);
    this.drawGrid(world, centre, step);
    const beside = pen.colour("beside");
    const other = second && errorOf(second).map((part, k) => centre[k] + part);
    if (!second) world.line(this.path, pen.PATH, 2); // path and target stand elsewhere, seen from the other diamond
    if (finite(compliant)) this.trails[0].draw(world, pen.GREY, 1.5, compliant);
    if (second) this.trails[1].draw(world, beside, 1.2, centre);
    world.line([compliant, position], pen.FORCE, 1.5);
    if (second) this.drawDashed(world, [centre, other], beside);
    else pen.targetMarker(world, target, 9);
    pen.compliantMarker(world, compliant, 7.8);
    if (second) world.disc(other, 5, pen.SHEET, beside, 2.5);
    pen.endEffectorMarker(world, position, 4.2);
    for (const [place, colour] of [second ? [other, beside] : [target, pen.TARGET], [position, pen.END_EFFECTOR]]) {
      this.pointOut(world, centre, place, colour);
    }
    this.drawScale(world, step);
    this.errorsOf(frame, means).lines.forEach(({ words, y, size }, k) => {
      if (words) world.text(words, [width / 2, y], { colour: [pen.FORCE, beside][k], weight: 700, size });
    });
    this.name(`magnified ${(scale / mainScale).toFixed(0)} times`);
  }

  /** The errors that are written, in the upper part of the lens: `lines` of { words, y, size }, px, and where they end. */
  errorsOf(frame, means) {
    const { width, height } = this.sheet;
    const size = Math.max(12, 0.06 * width);
    const rigs = rigsOf(frame);
    if (rigs.length > 1 && width < SMALL) return { lines: [], foot: 0 };
    const first = Math.max((rigs.length > 1 ? 0.19 : 0.14) * height, 1.5 * size);
    const lines = rigs.map((_, k) => {
      const y = first + 1.25 * size * k;
      const error = means[k]?.error_mm;
      if (!Number.isFinite(error)) return { words: "", y, size };
      const top = y - 0.6 * size;
      const chord = 2 * Math.sqrt(top * (height - top)) - 2 * RIM;
      const shorter = [`error ${error.toFixed(2)} mm`, `${error.toFixed(2)} mm`, `${error.toFixed(0)} mm`];
      return { words: shorter.find((words) => widthOf(words, { weight: 700, size }) <= chord) ?? "", y, size };
    });
    return { lines, foot: lines.at(-1).y + 0.6 * size };
  }

  drawDashed(world, points, colour) {
    world.context.setLineDash([5, 3]);
    world.line(points, colour, 1.5);
    world.context.setLineDash([]);
  }

  name(words) {
    if (words !== this.times) this.heading.textContent = this.times = words;
  }

  drawGrid(world, centre, step) {
    const { width, height } = this.sheet;
    const frame = new Axis(centre, [1, 0]);
    const [across, up] = [width / 2 / world.scale, height / 2 / world.scale];
    for (let i = -Math.floor(across / step); i <= across / step; i += 1) {
      world.line([frame.at(i * step, -up), frame.at(i * step, up)], pen.GRID);
    }
    for (let i = -Math.floor(up / step); i <= up / step; i += 1) {
      world.line([frame.at(-across, i * step), frame.at(across, i * step)], pen.GRID);
    }
  }

  drawScale(world, step) {
    const { context } = world;
    const foot = 0.9 * this.sheet.height;
    const left = (this.sheet.width - step * world.scale) / 2;
    const right = left + step * world.scale;
    context.beginPath();
    for (const [x, y] of [[left, foot - 4], [left, foot], [right, foot], [right, foot - 4]]) context.lineTo(x, y);
    context.strokeStyle = pen.INK;
    context.lineWidth = 1.5;
    context.stroke();
    world.text(`${1e3 * step} mm`, [this.sheet.width / 2, foot - 9], { weight: 500 });
  }

  /** A triangle at the edge that points to what lies outside the window. */
  pointOut(world, centre, place, colour) {
    if (!finite(place)) return;
    const [dx, dy] = [place[0] - centre[0], place[1] - centre[1]];
    const far = (2 * Math.hypot(dx, dy) * world.scale) / Math.min(this.sheet.width, this.sheet.height);
    if (far <= 1) return;
    const angle = Math.atan2(-dy, dx);
    const corners = [0, 2.4, -2.4].map((turn) => [8 * Math.cos(angle + turn), 8 * Math.sin(angle + turn)]);
    world.shape([centre[0] + (0.88 * dx) / far, centre[1] + (0.88 * dy) / far], corners, colour, pen.PAPER);
  }
}
