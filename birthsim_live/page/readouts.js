// Figures under the rig, and the line that says how the machine keeps up.

import { LEAST_FORCE, LEAST_GIVEN } from "./frame.js";
import { formula } from "./symbols.js";
import { term } from "./terms.js";

const WRITTEN_GAP = 2000; // ms between changes of the status line
const SPOKEN_GAP = 10000; // ms between words on how the machine keeps up: a busy one falls behind again and again
const PACES = ["well", "slow"];
const KEEPS_UP = 0.98;

const signed = (value, digits) =>
  Number.isFinite(value) ? `${value < 0 || Object.is(Math.round(value * 10 ** digits), -0) ? "−" : "+"}${Math.abs(value).toFixed(digits)}` : "–";
const pair = (values, digits, factor = 1) => values.map((value) => signed(factor * value, digits)).join("  ");
const plain = (value) => (Number.isFinite(value) ? value.toFixed(2) : "–");
const difference = (a, b) => [a[0] - b[0], a[1] - b[1]];

/**
 * Stiffness, N/m, that the hand feels along its force, and that it should: [felt, asked], or null where it hardly pulls or
 * nothing gives way.
 */
export function stiffness({ force, position, target, compliant }) {
  const size = Math.hypot(...force);
  if (!(size >= LEAST_FORCE)) return null;
  const given = ([x, y]) => ((x - target[0]) * force[0] + (y - target[1]) * force[1]) / size;
  return given(position) >= LEAST_GIVEN ? [size / given(position), size / given(compliant)] : null;
}

const round = (value) => Number(value.toPrecision(3)).toLocaleString("en");

function felt(frame) {
  const found = stiffness(frame);
  return found ? [round(found[0]), ` N/m, asked for ${round(found[1])}`] : ["–", " N/m"];
}

const FIGURES = [
  ["the hand feels", [], "", felt],
  ["time", [["t"]], "s", ({ time }) => time.toFixed(2)],
  ["user force", [["F", "us,x"], ", ", ["F", "us,y"]], "N", (frame) => pair(frame.force, 1)],
  ["displacement", [["x", "c"], " − ", ["x", "t"], ", ", ["y", "c"], " − ", ["y", "t"]], "mm", (frame) => pair(difference(frame.position, frame.target), 1, 1e3)],
  ["force over stiffness", [["F", "us"], "/", ["K", "cl"]], "mm", (frame) => pair(difference(frame.compliant, frame.target), 1, 1e3)],
  ["error", [], "", (frame, rms) => [plain(frame.error_mm), ` mm, RMS ${plain(rms)}`]],
];
const IN_LAB = ["time", "displacement", "force over stiffness"];

export class Readouts {
  /** `status` is the line that is seen, `spoken` the one that screen readers speak. */
  constructor(list, status, spoken) {
    this.status = status;
    this.spoken = spoken;
    this.written = -Infinity;
    this.told = { kind: null, at: -Infinity };
    this.values = FIGURES.map(([title, symbol, unit], i) => {
      const box = document.createElement("div");
      const name = document.createElement("dt");
      name.append(term(title), " ", formula(symbol));
      const value = document.createElement("dd");
      const digits = document.createElement("span");
      const inUnit = document.createElement("small");
      inUnit.textContent = ` ${unit}`;
      value.append(digits, inUnit);
      box.append(name, value);
      box.dataset.figure = title;
      box.className = IN_LAB.includes(title) ? "lab-only" : "";
      if (i === 0) box.className = "felt";
      list.append(box);
      return [digits, inUnit];
    });
  }

  /** `one` is the mean (means.js) of the rig that is chosen, `rms` that of its error, mm. */
  step(one, rms, frame, state, now) {
    if (one !== this.last) this.write(one, rms);
    this.last = one;
    this.say(...pace(frame, state), now);
  }

  write(one, rms) {
    FIGURES.forEach(([, , , words], i) => {
      [words(one, rms)].flat().forEach((text, k) => {
        if (this.values[i][k].textContent !== text) this.values[i][k].textContent = text;
      });
    });
  }

  /** Change the status line, at once where its kind changes, else seldom. Screen readers speak what kind it has become. */
  say(kind, words, now = performance.now()) {
    const flaps = PACES.includes(kind) && PACES.includes(this.told.kind) && now - this.told.at < SPOKEN_GAP;
    if (kind !== this.told.kind && !flaps) {
      this.spoken.textContent = words;
      this.told = { kind, at: now };
    }
    if (words === this.status.textContent) return;
    if (kind === this.status.dataset.kind && now - this.written < WRITTEN_GAP) return;
    this.written = now;
    this.status.dataset.kind = kind;
    this.status.textContent = words;
  }
}

/** How the physics keeps pace with the clock, in words. */
function pace(frame, state) {
  if (state.paused) return ["paused", "paused"];
  if (frame.real_time == null) return ["waiting", "waiting"];
  const share = Math.round(100 * frame.real_time);
  const goal = state.speed < 1 ? `1 : ${Math.round(1 / state.speed)}` : "real time";
  const behind = frame.behind >= 0.05 ? `${frame.behind.toFixed(1)} s behind` : "";
  if (frame.real_time < KEEPS_UP) return ["slow", [`physics at ${share} % of ${goal}`, behind].filter(Boolean).join("; ")];
  return ["well", `in ${goal === "real time" ? goal : `slow motion, ${goal}`}${behind && `; ${frame.behind.toFixed(1)} s lost earlier`}`];
}
