// Colours, markers and the force arrow, as in birthsim_env/drawing/pen.py, so that page and video look alike.

const NAMES = [
  "paper", "sheet", "ink", "grey", "faint", "grid", "steel", "cap", "skin", "skin-edge", "ground", "ground-edge", "line",
  "end-effector", "target", "compliant", "path", "force",
];
export let PAPER, SHEET, INK, GREY, FAINT, GRID, STEEL, CAP, SKIN, SKIN_EDGE, GROUND, GROUND_EDGE, LINE;
export let END_EFFECTOR, TARGET, COMPLIANT, PATH, FORCE;

const known = new Map();

/** A colour of colours.css, by day or by night. */
export function colour(name) {
  if (!known.has(name)) known.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return known.get(name);
}

function read() {
  known.clear();
  [
    PAPER, SHEET, INK, GREY, FAINT, GRID, STEEL, CAP, SKIN, SKIN_EDGE, GROUND, GROUND_EDGE, LINE,
    END_EFFECTOR, TARGET, COMPLIANT, PATH, FORCE,
  ] = NAMES.map(colour);
}

read();

/** Calls `redraw` when day turns to night or back. */
export function onNightfall(redraw) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    read();
    redraw();
  });
}

const LOW_PRESSURE = [240, 246, 252];
const HIGH_PRESSURE = [14, 52, 128];

export const FONT = '"Liberation Sans", "Helvetica Neue", Arial, sans-serif';

/** Colour of air: `share` is 0 at atmospheric and 1 at supply pressure. */
export function airColour(share) {
  if (!Number.isFinite(share)) return STEEL;
  const s = Math.min(Math.max(share, 0), 1);
  const [r, g, b] = LOW_PRESSURE.map((low, i) => Math.round(low + s * (HIGH_PRESSURE[i] - low)));
  return `rgb(${r}, ${g}, ${b})`;
}

/** A direction in the plane: `at(s, n)` is the point s metres along it and n to its left. */
export class Axis {
  constructor(origin, along) {
    this.origin = origin;
    this.along = along;
  }

  at(s, n = 0) {
    const [ox, oy] = this.origin;
    const [ax, ay] = this.along;
    return [ox + s * ax - n * ay, oy + s * ay + n * ax];
  }

  box(start, end, half) {
    return [this.at(start, half), this.at(end, half), this.at(end, -half), this.at(start, -half)];
  }
}

export const finite = (point) => Boolean(point) && Number.isFinite(point[0]) && Number.isFinite(point[1]);

/** Draws in metres (y up) on a canvas context whose unit is the CSS pixel; skips what is not finite. */
export class Pen {
  constructor(context, origin, scale) {
    this.context = context;
    this.origin = origin;
    this.scale = scale;
  }

  pixel([x, y]) {
    return [this.origin[0] + this.scale * x, this.origin[1] - this.scale * y];
  }

  metres([column, row]) {
    return [(column - this.origin[0]) / this.scale, (this.origin[1] - row) / this.scale];
  }

  trace(points, closed) {
    const { context } = this;
    context.beginPath();
    let down = false;
    for (const point of points) {
      if (!finite(point)) {
        down = false;
        continue;
      }
      const [x, y] = this.pixel(point);
      if (down) context.lineTo(x, y);
      else context.moveTo(x, y);
      down = true;
    }
    if (closed) context.closePath();
  }

  polygon(points, fill, edge = null, px = 1) {
    if (!points.every(finite)) return;
    this.trace(points, true);
    this.context.fillStyle = fill;
    this.context.fill();
    if (edge) this.stroke(edge, px);
  }

  line(points, colour, px = 1) {
    this.trace(points, false);
    this.stroke(colour, px);
  }

  stroke(colour, px) {
    this.context.strokeStyle = colour;
    this.context.lineWidth = px;
    this.context.stroke();
  }

  disc(centre, radius, fill, edge = null, px = 1) {
    if (!finite(centre)) return;
    const [x, y] = this.pixel(centre);
    this.context.beginPath();
    this.context.arc(x, y, Math.max(radius, 0), 0, 2 * Math.PI);
    if (fill) {
      this.context.fillStyle = fill;
      this.context.fill();
    }
    if (edge) this.stroke(edge, px);
  }

  /** Polygon whose corners are pixel offsets (y down) from a point in metres. */
  shape(centre, corners, fill, edge = null) {
    if (!finite(centre)) return;
    const [x, y] = this.pixel(centre);
    const { context } = this;
    context.beginPath();
    for (const [dx, dy] of corners) context.lineTo(x + dx, y + dy);
    context.closePath();
    context.fillStyle = fill;
    context.fill();
    if (edge) this.stroke(edge, 1);
  }

  /** Text at a pixel, with a light rim that lifts it off what lies below. */
  text(words, [x, y], look) {
    const { image, width, height, ratio } = lettered(words, { colour: INK, ...PLAIN, ...look });
    const shift = { left: 2, center: width / 2, right: width - 2 }[look?.align ?? PLAIN.align];
    const whole = (value) => Math.round(value * ratio) / ratio; // between pixels of the screen letters blur
    this.context.drawImage(image, whole(x - shift), whole(y - height / 2), image.width / ratio, image.height / ratio);
  }
}

const PLAIN = { size: 12, weight: 600, align: "center" };
/** How wide words are, px, with their rim. */
export function widthOf(words, look) {
  return lettered(words, { colour: INK, ...PLAIN, ...look }).width;
}

const MOST_TEXTS = 500;
const texts = new Map();

/** A picture of some words, kept since most words return frame after frame and rims are slow to draw. */
function lettered(words, { colour, size, weight }) {
  const ratio = Math.min(window.devicePixelRatio || 1, 3);
  const name = `${words}|${colour}|${size}|${weight}|${ratio}`;
  if (texts.has(name)) return texts.get(name);
  if (texts.size > MOST_TEXTS) texts.clear();
  const image = document.createElement("canvas");
  const context = image.getContext("2d");
  const font = `${weight} ${size}px ${FONT}`;
  context.font = font;
  const width = Math.ceil(context.measureText(words).width) + 4;
  const height = Math.ceil(1.4 * size) + 4;
  image.width = Math.ceil(width * ratio);
  image.height = Math.ceil(height * ratio);
  context.scale(ratio, ratio);
  Object.assign(context, { font, textBaseline: "middle", lineJoin: "round", strokeStyle: PAPER, lineWidth: 4, fillStyle: colour });
  context.strokeText(words, 2, height / 2);
  context.fillText(words, 2, height / 2);
  const text = { image, width, height, ratio };
  texts.set(name, text);
  return text;
}

/** Hollow ring with four ticks: it leaves free what lies inside it. */
export function targetMarker(pen, at, size) {
  pen.disc(at, size, null, PAPER, 0.3 * size + 2);
  const inner = 0.95 * size;
  const outer = 1.6 * size;
  const half = Math.max(0.6, 0.13 * size);
  const tick = [[inner, half], [outer, half], [outer, -half], [inner, -half]];
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    pen.shape(at, tick.map(([r, h]) => [dx * r + dy * h, dy * r + dx * h]), TARGET);
  }
  pen.disc(at, size - 0.13 * size, null, TARGET, Math.max(1.2, 0.26 * size));
}

/** Filled diamond. */
export function compliantMarker(pen, at, size) {
  pen.shape(at, [[size, 0], [0, size], [-size, 0], [0, -size]], COMPLIANT, INK);
}

/** Black dot with a light rim. */
export function endEffectorMarker(pen, at, size) {
  pen.disc(at, size + 0.8, PAPER);
  pen.disc(at, size, END_EFFECTOR);
}

/** Force arrow between two pixels, its shaft `px` wide. */
export function arrow(context, start, end, px) {
  const length = Math.hypot(end[0] - start[0], end[1] - start[1]);
  if (!(length > 0 && Number.isFinite(length))) return;
  const axis = new Axis(start, [(end[0] - start[0]) / length, (end[1] - start[1]) / length]);
  const neck = Math.max(length - 3.2 * px, 0);
  const half = px / 2;
  const outline = [
    axis.at(0, half), axis.at(neck, half), axis.at(neck, 3.2 * half), end,
    axis.at(neck, -3.2 * half), axis.at(neck, -half), axis.at(0, -half),
  ];
  context.beginPath();
  for (const [x, y] of outline) context.lineTo(x, y);
  context.closePath();
  context.strokeStyle = PAPER;
  context.lineWidth = 3;
  context.stroke();
  context.fillStyle = FORCE;
  context.fill();
}
