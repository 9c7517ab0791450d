// The main view: rig, path, targets, the user's force and the spring to the pointer (birthsim_env/drawing/picture.py).

import { Leader } from "./leader.js";
import * as pen from "./pen.js";
import { Pen } from "./pen.js";
import { chamberNames, drawGhost, drawGround, drawRig, extent, noteOf, poseOf } from "./rig.js";
import { Sheet } from "./sheet.js";
import { Trail } from "./trail.js";

const MARGIN = 10;
const STRIP = 8; // px below the rig, for scale bar and notes
const CUE_TIME = 2200; // ms of the hint's motion, and px that it goes
const CUE_LENGTH = 90;
const STILL = matchMedia("(prefers-reduced-motion: reduce)");
const LEAST_FORCE = 0.05; // N; below it an arrow would only flicker
const REACH = 0.075; // m that a hand moves the head, unless the spring is soft
const SOFT = 1400; // N/m
const NARROW = 760; // px; narrower pictures have this room, m, for the arrow of a pull
const ROOM = 0.06;
const LEAST_ARROW = 24; // px

export class Scene {
  /** `cue`: until somebody has pulled, a hint shows what to do. */
  constructor(canvas, { cue }) {
    this.geometry = null;
    this.path = [];
    this.soft = false;
    this.escaped = false; // the head has left what is in sight
    this.leader = new Leader(canvas);
    this.trail = new Trail();
    this.cue = cue;
    this.sheet = new Sheet(canvas, { changed: () => this.layOut(), opaque: true });
    pen.onNightfall(() => this.layOut());
  }

  setUp({ geometry, air, cylinders, guide, drag_limit: limit }) {
    Object.assign(this, { geometry, air, cylinders, guide, limit });
    this.layOut();
  }

  setPath(points) {
    this.path = points;
    this.layOut();
  }

  setStiffness(...stiffnesses) {
    this.see(Math.min(...stiffnesses) < SOFT, this.escaped);
  }

  /** Show all that the head can reach, or only what is near its path, larger. */
  see(soft, escaped) {
    if (soft === this.soft && escaped === this.escaped) return;
    Object.assign(this, { soft, escaped });
    this.layOut();
  }

  /** It has no room: a small screen shows one picture of two. */
  get hidden() {
    return !this.sheet.width;
  }

  /** Lower left and upper right corner, m, of what is in sight: the linkage, and the head wherever it may go. */
  bounds() {
    const [low, high] = extent(this.geometry);
    if (this.soft || this.escaped || !this.path.length) return [low, high];
    const reach = REACH + this.geometry.head.radius;
    const [xs, ys] = [0, 1].map((k) => this.path.map((point) => point[k]));
    const { width } = this.sheet;
    if (width < NARROW) {
      high[0] += ROOM;
      xs.push(Math.max(...xs) + ROOM);
    }
    return [[low[0], Math.max(low[1], Math.min(...ys) - reach)], [Math.min(high[0], Math.max(...xs) + reach), high[1]]];
  }

  /** Scale and origin so that all poses fill the room, and all that does not move on a backdrop. */
  layOut() {
    if (!this.geometry || !this.sheet?.width) return;
    const { width, height } = this.sheet;
    const [low, high] = this.bounds();
    const room = [width - 2 * MARGIN, height - STRIP - 2 * MARGIN];
    const scale = Math.min(room[0] / (high[0] - low[0]), room[1] / (high[1] - low[1]));
    const origin = [
      width / 2 - (scale * (low[0] + high[0])) / 2,
      MARGIN + room[1] / 2 + (scale * (low[1] + high[1])) / 2,
    ];
    this.unit = Math.min(Math.max(scale / 490, 0.6), 1.5); // 490 px/m is the scale of the 640x480 drawing
    this.pen = new Pen(this.sheet.context, origin, scale);
    this.leader.leaveRoom(this.pen, this.path, this.geometry.head);
    this.drawBackdrop(origin, scale);
  }

  drawBackdrop(origin, scale) {
    const { width, height } = this.sheet;
    const context = this.sheet.backdrop();
    const ground = new Pen(context, origin, scale);
    context.fillStyle = pen.PAPER;
    context.fillRect(0, 0, width, height);
    drawGround(ground, this.geometry, this.cylinders);
    const [left, foot, length] = [2 * MARGIN, height - MARGIN, 0.1 * scale];
    context.beginPath();
    for (const [x, y] of [[left, foot - 4], [left, foot], [left + length, foot], [left + length, foot - 4]]) context.lineTo(x, y);
    context.strokeStyle = pen.INK;
    context.lineWidth = 1.5;
    context.stroke();
    ground.text("100 mm", [left + length + 6, foot - 4], { align: "left", weight: 500 });
    this.backdrop = context;
  }

  /** Where the end effector is held, px: the radius of the head, but never less than a finger needs. */
  grip(coarse) {
    return Math.max(1.1 * this.geometry.head.radius * this.pen.scale, coarse ? 34 : 18);
  }

  /** Take note of a frame: the trail holds the way of the end effector. */
  push({ time, position }) {
    const { points } = this.trail;
    const anew = time < points.at(-1)?.time;
    this.trail.push(time, position);
    if (anew) this.see(this.soft, false);
    if (!this.geometry || this.escaped || !pen.finite(position)) return;
    const [low, high] = this.bounds();
    if (position.some((value, k) => value < low[k] || value > high[k])) this.see(this.soft, true);
  }

  /**
   * `held` is the offset, m, from end effector to the place where this window holds it, or null; `lens` a magnifier;
   * `ghost` a frame of another rig whose head is to be seen here, or null; `mean` what is written of this one (means.js).
   */
  draw(frame, { held, lens, ghost, mean }) {
    if (!this.pen || this.hidden) return;
    this.sheet.check();
    const { pen: world, unit, geometry, cylinders } = this;
    this.sheet.lay(this.backdrop);
    world.context.lineJoin = "miter";
    world.line(this.path, pen.PATH, 2 * unit);
    const pose = poseOf(frame, geometry);
    const { supply, atmosphere } = this.air;
    if (pose) {
      const colours = frame.pressures.map((p) => pen.airColour((p - atmosphere) / (supply - atmosphere)));
      drawRig(world, pose, geometry, cylinders, colours);
    }
    world.line(this.path, pen.PATH, 0.8 * unit); // once more, thin: the path goes on across head and rod
    this.trail.draw(world, pen.INK, 1.6 * unit);
    const other = ghost && poseOf(ghost, geometry);
    if (other) drawGhost(world, other, geometry, pen.colour("beside"));
    this.leader.draw(world, frame.compliant, lens);
    const size = Math.max(2.8, 3.8 * unit);
    pen.targetMarker(world, frame.target, 1.75 * size);
    pen.compliantMarker(world, frame.compliant, 1.35 * size);
    const label = pose && this.drawForce(frame, mean ?? frame, pose, this.hand(frame, held ?? [0, 0]));
    if (frame.pointer) this.drawSpring(frame, held ?? [0, 0]);
    pen.endEffectorMarker(world, frame.position, 0.75 * size);
    if (pose && "lab" in document.body.dataset) this.drawNames(pose);
    if (this.cue && pose && !label && !frame.pointer && document.body.dataset.mode === "live") this.drawCue(frame);
    if (label) world.text(label.words, label.at, { colour: pen.FORCE, size: 14, weight: 700 });
    this.drawNote(noteOf(frame, geometry));
  }

  /** The spring from the hand's hold on the end effector to the pointer. */
  drawSpring(frame, [hx, hy]) {
    const { context } = this.pen;
    const from = this.pen.pixel([frame.position[0] + hx, frame.position[1] + hy]);
    const to = this.pen.pixel([frame.pointer[0] + hx, frame.pointer[1] + hy]);
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    const turns = Math.max(5, Math.round(length / 16));
    context.beginPath();
    context.moveTo(...from);
    if (length > 8) {
      const [ux, uy] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
      const lead = Math.min(6, length / 6);
      for (let i = 0; i <= 2 * turns; i += 1) {
        const along = lead + ((length - 2 * lead) * i) / (2 * turns);
        const aside = i === 0 || i === 2 * turns ? 0 : 4.5 * (i % 2 ? 1 : -1);
        context.lineTo(from[0] + ux * along - uy * aside, from[1] + uy * along + ux * aside);
      }
    }
    context.lineTo(...to);
    context.lineJoin = "round";
    context.strokeStyle = pen.PAPER;
    context.lineWidth = 3.5;
    context.stroke();
    context.strokeStyle = pen.CAP;
    context.lineWidth = 1.5;
    context.stroke();
    const end = [frame.pointer[0] + hx, frame.pointer[1] + hy];
    this.pen.disc(end, 5, pen.PAPER, pen.CAP, 2);
  }

  /** A finger that pulls the head to the right, or along a rail, again and again; it rests where the person wants no motion. */
  drawCue({ position }) {
    const part = STILL.matches ? 0.7 : (performance.now() % CUE_TIME) / CUE_TIME;
    const passed = Math.min(1, part / 0.7);
    const [ux, uy] = this.guide ?? [1, 0];
    const length = Math.min(CUE_LENGTH * this.unit, this.roomAlong(this.pen.pixel(position), [ux, -uy]) - CUE_LENGTH / 3);
    const ahead = (length * passed * passed * (3 - 2 * passed)) / this.pen.scale;
    const { context } = this.pen;
    const from = [position[0], position[1]];
    const to = [position[0] + ahead * ux, position[1] + ahead * uy];
    context.globalAlpha = part > 0.85 ? (1 - part) / 0.15 : 1;
    this.pen.line([from, to], pen.INK, 3);
    this.pen.disc(to, 11, pen.PAPER, pen.INK, 2.5);
    this.pen.disc(to, 4, pen.INK);
    const [x, y] = this.pen.pixel(to);
    this.pen.text("pull", [x, y - 24], { size: 15, weight: 700 });
    context.globalAlpha = 1;
  }

  drawNames(pose) {
    const away = 9 / this.pen.scale;
    for (const [name, place] of chamberNames(pose, this.geometry, this.cylinders, away)) {
      this.pen.text(name, this.pen.pixel(place), { weight: 700 });
    }
  }

  drawNote(note) {
    if (note) this.pen.text(note, [this.sheet.width - MARGIN, this.sheet.height - 14], { colour: pen.FORCE, size: 13, align: "right" });
  }

  /** Where the spring ends, px from the end effector, or null. */
  hand({ pointer, position }, [hx, hy]) {
    return pointer && [(pointer[0] + hx - position[0]) * this.pen.scale, -(pointer[1] + hy - position[1]) * this.pen.scale];
  }

  /**
   * Arrow of the user's force at the head, or beyond the `hand` where that pulls the same way; returns the arrow's label, which
   * has the `mean` that is written elsewhere, and where that belongs, px.
   */
  drawForce({ force: [fx, fy], drag_force: drag }, mean, pose, hand) {
    const newtons = Math.hypot(fx, fy);
    if (!(newtons > LEAST_FORCE && Number.isFinite(newtons))) return null;
    const { unit } = this;
    const [x, y] = this.pen.pixel(pose.endEffector);
    const [dx, dy] = [fx / newtons, -fy / newtons];
    const edge = 1.2 * this.geometry.head.radius * this.pen.scale;
    const along = hand ? dx * hand[0] + dy * hand[1] : 0;
    const start = hand && Math.abs(dx * hand[1] - dy * hand[0]) < 0.5 * along ? Math.max(edge, along + 9) : edge;
    const length = unit * Math.min(14 + 0.8 * newtons, 110);
    const written = Math.hypot(...mean.force);
    const most = Math.hypot(...drag) > this.limit - 0.5 && Math.abs(written - newtons) < 0.5 ? ", the most" : "";
    const words = `${written < 1e5 ? written.toFixed(0) : written.toExponential(1)} N${most}`;
    const half = [4.2 * words.length + 4, 9];
    const inside = (at, room) =>
      at[0] > room[0] && at[0] < this.sheet.width - room[0] && at[1] > room[1] && at[1] < this.sheet.height - STRIP - room[1];
    const free = (distance) => inside([x + dx * distance, y + dy * distance], [4, 4]);
    // Clear of the cylinders where there is room: a pull leaves the head, a force into the machine ends at it as a push.
    const pull = [start, Math.max(Math.min(start + length, this.roomAlong([x, y], [dx, dy]) - 6), start + LEAST_ARROW)];
    const push = [-edge - length, -edge];
    const [ax, ay] = pose.axes[1].along;
    const intoMachine = fx * ax + fy * ay < -0.5 * newtons;
    const [tail, tip] = (intoMachine ? free(push[0]) || !free(pull[1]) : !free(pull[1]) && free(push[0])) ? push : pull;
    pen.arrow(this.pen.context, [x + dx * tail, y + dy * tail], [x + dx * tip, y + dy * tip], 5 * unit);
    const far = tail > 0 ? tip : tail;
    const middle = (tail + tip) / 2;
    const beyond = far + Math.sign(far) * (Math.abs(dx) * half[0] + Math.abs(dy) * half[1] + 2 * unit);
    const aside = Math.abs(dy) * half[0] + Math.abs(dx) * half[1] + 8 * unit;
    const places = [
      [x + dx * beyond, y + dy * beyond],
      ...[aside, -aside].map((s) => [x + dx * middle - dy * s, y + dy * middle + dx * s]),
    ];
    return { words, at: places.find((place) => inside(place, half)) ?? this.nearest(places[0], half) };
  }

  /** How far it is, px, from a pixel to the edge of the picture. */
  roomAlong([x, y], [dx, dy]) {
    const [right, foot] = [this.sheet.width, this.sheet.height - STRIP];
    const ways = [dx > 0 ? (right - x) / dx : -x / dx, dy > 0 ? (foot - y) / dy : -y / dy];
    return Math.min(...ways.filter((way) => way >= 0));
  }

  /** Off limits, a label stays in the picture on the side where the head has left it. */
  nearest([x, y], [halfWidth, halfHeight]) {
    const clip = (value, least, most) => Math.min(Math.max(value, least), most);
    return [clip(x, halfWidth, this.sheet.width - halfWidth), clip(y, halfHeight, this.sheet.height - STRIP - halfHeight)];
  }
}
