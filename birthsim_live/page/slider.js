// A slider over round values, logarithmic where asked, with symbol, unit and value.

import { formula } from "./symbols.js";

const STEPS = 200;

/** The values a slider can take: round ones, a few per cent apart if the range is logarithmic. */
function scaleOf({ min, max, log }) {
  const values = [min];
  for (let value = min; value < max; ) {
    const step = log ? fineStep(value) : roundStep((max - min) / STEPS);
    value = clean((Math.floor(value / step + 1e-6) + 1) * step);
    if (value < max) values.push(value);
  }
  return [...values, max];
}

function fineStep(value) {
  const decade = 10 ** Math.floor(Math.log10(value) + 1e-9);
  const leading = value / decade;
  return decade * (leading < 2 ? 0.05 : leading < 5 ? 0.1 : 0.2);
}

function roundStep(rough) {
  const decade = 10 ** Math.floor(Math.log10(rough));
  return decade * ([1, 2, 5].find((factor) => factor * decade >= rough * 0.999) ?? 10);
}

const clean = (value) => Number(value.toPrecision(10));

/** 1250 N/m, 3.20 kg; a plain factor is "× 1.50". */
function words(value, { unit, max }) {
  const digits = max >= 100 ? Math.round(value).toString() : value.toFixed(2);
  return unit === "1" ? `× ${digits}` : `${digits} ${unit}`;
}

export class NumberField {
  /** `title` is what stands beside the slider, as a formula; the range's own label is what a screen reader says. */
  constructor(name, title, range, change) {
    this.range = range;
    this.scale = scaleOf(range);
    this.change = change;
    this.held = false;
    this.asked = null;
    this.build(name, title);
  }

  build(name, title) {
    this.element = document.createElement("div");
    this.element.className = "number";
    this.element.title = this.range.label;
    const label = document.createElement("label");
    label.htmlFor = `set-${name}`;
    label.append(formula(title));
    this.output = document.createElement("span");
    this.output.className = "value";
    this.output.setAttribute("aria-hidden", "true");
    this.input = document.createElement("input");
    Object.assign(this.input, { type: "range", id: `set-${name}`, name, min: 0, max: this.scale.length - 1, step: 1 });
    this.input.addEventListener("input", () => this.ask());
    this.input.addEventListener("pointerdown", () => (this.held = true));
    for (const type of ["pointerup", "pointercancel", "blur"]) this.input.addEventListener(type, () => (this.held = false));
    this.input.setAttribute("aria-label", this.range.label);
    this.element.append(label, this.output, this.input);
  }

  /** At most one message per frame of the screen, however fast the slider moves. */
  ask() {
    const value = this.scale[this.input.valueAsNumber];
    this.write(value);
    if (this.asked === null) {
      requestAnimationFrame(() => {
        this.change(this.asked);
        this.asked = null;
      });
    }
    this.asked = value;
  }

  write(value) {
    const text = words(value, this.range);
    this.output.textContent = text;
    this.input.setAttribute("aria-valuetext", text);
  }

  /** Show what the rig has; a slider in somebody's hand stays there. */
  show(value) {
    if (this.held || this.asked !== null || !Number.isFinite(value)) return;
    this.write(value);
    const next = this.scale.findIndex((known) => known >= value);
    const above = next < 0 ? this.scale.length - 1 : next;
    const below = Math.max(above - 1, 0);
    this.input.value = value - this.scale[below] < this.scale[above] - value ? below : above;
  }

  enable(on, reason) {
    this.input.disabled = !on;
    this.element.title = on ? this.range.label : reason;
    this.element.classList.toggle("off", !on);
  }
}
