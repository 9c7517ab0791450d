// The linkage: cylinders, pins, fetal head and the column that carries them (birthsim_env/drawing/rig.py).
// Every dimension and the outline of the head come from Python. `cylinders` are those that there are, counted from 0: [1] on a rail.

import { Axis, CAP, FAINT, GROUND, GROUND_EDGE, INK, LINE, PAPER, SKIN, SKIN_EDGE, STEEL, finite } from "./pen.js";

const NEAR_STOP = 1e-4; // m

/** Axes of both cylinders and their piston positions, or null where the linkage has no pose. */
export function poseOf(frame, geometry) {
  if (!frame.linkage) return null;
  const [, joint, pivot, endEffector] = frame.linkage;
  const along = ([ax, ay], [bx, by]) => {
    const length = Math.hypot(bx - ax, by - ay) || 1;
    return [(bx - ax) / length, (by - ay) / length];
  };
  return {
    piston: frame.joints,
    axes: [new Axis(geometry.pivot1, along(geometry.pivot1, joint)), new Axis(pivot, along(pivot, endEffector))],
    joint,
    endEffector,
  };
}

/** Lower left and upper right corner, m, of all that is drawn in any pose. */
export function extent(geometry) {
  const [left, bottom, right, top] = geometry.bounds;
  return [[left, bottom], [right, top]];
}

/** Workspace of the end effector and the column. */
export function drawGround(pen, geometry, cylinders) {
  pen.polygon(geometry.workspace, GROUND, GROUND_EDGE);
  if (!cylinders.includes(0)) return;
  const column = new Axis([0, 0], [Math.cos(geometry.gamma3), Math.sin(geometry.gamma3)]);
  const half = 0.8 * geometry.barrels[1].half_bore;
  pen.polygon(column.box(-2 * half, geometry.d3 + 2 * half, half), FAINT, LINE);
}

/** Everything that moves; `colours` of the chambers P1, N1, P2, N2. */
export function drawRig(pen, pose, geometry, cylinders, colours) {
  const both = cylinders.length > 1;
  const pins = [[0], both ? [0, geometry.d6] : [0]];
  for (const i of cylinders) {
    const barrel = geometry.barrels[i];
    const front = frontOf(barrel);
    for (const at of pins[i]) {
      // Where a pin lies beyond the barrel, a lug on the barrel carries it.
      if (at >= barrel.rear && at <= front) continue;
      const ends = at < barrel.rear ? [at, barrel.rear] : [front, at];
      pen.polygon(pose.axes[i].box(...ends, 0.6 * barrel.half_bore), CAP, INK);
    }
  }
  for (const i of [...cylinders].reverse()) drawCylinder(pen, pose.axes[i], geometry.barrels[i], pose.piston[i], colours.slice(2 * i, 2 * i + 2));
  const pin = 0.45 * pen.scale * geometry.barrels[1].half_bore;
  for (const place of [pose.axes[1].origin, ...(both ? [pose.axes[0].origin, pose.joint] : [])]) {
    pen.disc(place, 1.6 * pin, CAP, INK);
    pen.disc(place, 0.8 * pin, STEEL, INK);
  }
  drawHead(pen, new Axis(pose.endEffector, pose.axes[1].along), geometry.head);
}

const frontOf = (barrel) => barrel.rear + barrel.stroke + 2 * barrel.cap;

function drawCylinder(pen, axis, barrel, y, colours) {
  const start = barrel.rear + barrel.cap;
  const stop = start + barrel.stroke;
  const piston = start + barrel.stroke / 2 + y;
  const seat = Math.min(Math.max(piston, start), stop);
  const end = piston + barrel.rod;
  const thick = Math.min(0.35 * barrel.half_bore, 0.1 * barrel.stroke);
  pen.polygon(axis.box(start, seat, barrel.half_bore), colours[0]);
  pen.polygon(axis.box(seat, stop, barrel.half_bore), colours[1]);
  pen.polygon(axis.box(seat, end, barrel.half_rod), STEEL, INK);
  pen.line([axis.at(seat, 0.4 * barrel.half_rod), axis.at(end, 0.4 * barrel.half_rod)], PAPER);
  pen.polygon(axis.box(Math.max(seat - thick, start), Math.min(seat + thick, stop), barrel.half_bore), INK);
  for (const side of [-barrel.half_bore, barrel.half_bore]) pen.line([axis.at(start, side), axis.at(stop, side)], INK, 2);
  for (const from of [barrel.rear, stop]) pen.polygon(axis.box(from, from + barrel.cap, 1.25 * barrel.half_bore), CAP, INK);
}

const placedAt = (axis, head) => (shape) => shape.map(([s, n]) => axis.at(head.radius * s, -head.radius * n));

/** Only the outline of the head of another rig. */
export function drawGhost(pen, pose, { head }, colour) {
  const outline = placedAt(new Axis(pose.endEffector, pose.axes[1].along), head)(head.profile);
  pen.line([...outline, outline[0]], colour, 2);
}

/** Fetal head in profile, crown first. */
function drawHead(pen, axis, head) {
  const placed = placedAt(axis, head);
  pen.polygon(placed(head.profile), SKIN, SKIN_EDGE, 1.5);
  for (const feature of head.features) pen.line(placed(feature), SKIN_EDGE, 1.2);
}

/** P1, N1, P2, N2 and their places, m: `away` m beside the barrels, on the sides that face away from each other. */
export function chamberNames(pose, geometry, cylinders, away) {
  return cylinders.flatMap((i) => {
    const barrel = geometry.barrels[i];
    const aside = (i === 0 ? 1 : -1) * (1.25 * barrel.half_bore + away);
    const axis = pose.axes[i];
    return [
      [`P${i + 1}`, axis.at(barrel.rear + 2.2 * barrel.cap, aside)],
      [`N${i + 1}`, axis.at(frontOf(barrel) - 2.2 * barrel.cap, aside)],
    ];
  });
}

/** What the picture alone does not say; usually nothing. */
export function noteOf(frame, geometry) {
  if (!poseOf(frame, geometry)) return "no pose: linkage cannot close";
  const halves = [geometry.half_stroke1, geometry.half_stroke2];
  const ends = halves.flatMap((half, i) => (Math.abs(frame.joints[i]) > half - NEAR_STOP ? [i + 1] : []));
  return ends.length ? `cylinder${ends.length === 2 ? "s" : ""} ${ends.join(" and ")} at end stop` : "";
}
