// Rolling plots: one of them is redrawn with each frame, in turn, and only those that can be seen.

import uPlot from "./vendor/uPlot.esm.js";
import { SECOND } from "./curves.js";
import { FONT, colour } from "./pen.js";
import { formula } from "./symbols.js";
import { term } from "./terms.js";

const WINDOW = 8; // s
const RATE = 12; // redraws per second, where the machine bears it: all plots at once, so that all end at one instant
const LATE = 25; // ms between frames of the screen that show that it does not: the rig comes first
const LEAST_SHARE = 0.25; // of RATE
const HEADING_FONT = `11px ${FONT}`;
const GRID = { stroke: () => colour("grid"), width: 1 };

/** Round range around the data that grows at once and shrinks only when the data leave much of it empty. */
function calmRange(least, zero) {
  let kept = null;
  return (low, high) => {
    if (!(low <= high)) return kept ?? [0, least];
    const [from, to] = zero ? [Math.min(0, low), high] : [low, high];
    const span = Math.max(to - from, least);
    const step = niceStep(span / 4);
    const middle = (from + to) / 2;
    const bottom = zero && from === 0 ? 0 : Math.floor((middle - 0.53 * span) / step) * step;
    const top = Math.ceil((zero && from === 0 ? 1.06 * span : middle + 0.53 * span) / step) * step;
    const rim = kept && !(zero && from === 0) ? 0.02 * (kept[1] - kept[0]) : 0; // no curve on the frame
    const fits = kept && from >= kept[0] + rim && to <= kept[1] - rim && top - bottom > 0.6 * (kept[1] - kept[0]);
    if (!fits) kept = [bottom, top];
    return kept;
  };
}

function niceStep(rough) {
  const decade = 10 ** Math.floor(Math.log10(rough));
  return decade * ([1, 2, 5].find((factor) => factor * decade >= rough) ?? 10);
}

/** Extremes of what is finite in several series from the row `first` on. */
function extremes(columns, first) {
  let [low, high] = [Infinity, -Infinity];
  for (const column of columns) {
    for (let k = first; k < column.length; k += 1) {
      if (column[k] < low) low = column[k];
      if (column[k] > high) high = column[k];
    }
  }
  return [low, high];
}

class Plot {
  /** `shown` is what all plots show: { history, rig, duration, now }, the latter two of a whole recording; `rig` is 0 or 1. */
  constructor(definition, shown, parent) {
    this.definition = definition;
    this.shown = shown;
    this.visible = true;
    this.names = definition.curves.map(({ name }) => name);
    this.range = calmRange(definition.least, definition.zero);
    const figure = document.createElement("figure");
    figure.dataset.plot = definition.title;
    figure.append(heading(definition));
    this.place = document.createElement("div");
    this.place.className = "plot";
    figure.append(this.place);
    parent.append(figure);
    this.chart = new uPlot(this.options(), [[], ...definition.curves.map(() => [])], this.place);
    new ResizeObserver(() => this.resize()).observe(this.place);
    new IntersectionObserver((entries) => {
      this.visible = entries.at(-1).isIntersecting;
    }).observe(this.place);
  }

  options() {
    const axis = { stroke: () => colour("ink"), font: HEADING_FONT, grid: GRID, ticks: { ...GRID, size: 4 } };
    return {
      width: Math.max(this.place.clientWidth, 120),
      height: Math.max(this.place.clientHeight, 60),
      padding: [6, 16, 0, 0],
      cursor: { show: false },
      legend: { show: false },
      select: { show: false },
      scales: {
        x: { time: false, range: () => this.timeRange() },
        y: { range: () => this.valueRange() },
      },
      axes: [
        { ...axis, size: 20, gap: 2, space: 45, values: (_, splits) => splits.map((s) => `${s} s`) },
        { ...axis, size: 46, gap: 4, space: 24, values: (_, splits) => splits.map((value) => String(Math.round(1e6 * value) / 1e6)) },
      ],
      hooks: { draw: [(chart) => this.drawNow(chart)] },
      series: [{}, ...this.definition.curves.map(({ colour: name, width, dash }) => ({ stroke: () => colour(name), width, dash, points: { show: false } }))],
    };
  }

  /** Show what is of one of the `cylinders`, counted from 0, or of none of them. */
  setUp(cylinders) {
    this.definition.curves.forEach(({ name, cylinder }, k) => {
      const show = cylinder === undefined || cylinders.includes(cylinder);
      this.chart.setSeries(k + 1, { show });
      const item = this.place.parentElement.querySelector(`[data-curve="${name}"]`);
      if (item) item.hidden = !show;
    });
    this.names = this.definition.curves.filter((_, k) => this.chart.series[k + 1].show).map(({ name }) => name);
  }

  get history() {
    return this.shown.history;
  }

  /** What a curve shows of the rig that is chosen. */
  view(name) {
    return this.history.view(this.shown.rig && !this.definition.common ? SECOND + name : name);
  }

  /** The whole of a recording, or the last seconds. */
  timeRange() {
    if (this.shown.duration) return [0, this.shown.duration];
    const { newest } = this.history;
    return newest > WINDOW ? [newest - WINDOW, newest] : [0, WINDOW];
  }

  valueRange() {
    const { follow } = this.definition;
    const first = Math.max(0, this.history.view("time").findIndex((time) => time >= this.timeRange()[0]));
    const [low, high] = extremes((follow ?? this.names).map((name) => this.view(name)), first);
    return this.range(low, follow ? 1.5 * high : high);
  }

  /** Where a recording is now. */
  drawNow({ ctx: context, bbox, valToPos }) {
    if (!this.shown.duration) return;
    const x = Math.round(valToPos(this.shown.now, "x", true));
    context.fillStyle = colour("accent");
    context.fillRect(x - 1, bbox.top, 2, bbox.height);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (width && height) this.chart.setSize({ width, height });
  }

  redraw() {
    const column = ({ name, only, unless }) => {
      const values = this.view(name);
      if (!only && !this.shown.rig && !name.startsWith("rendered")) return values;
      // uPlot leaves a gap where a value is null, and typed arrays have none.
      const other = unless && this.view(unless);
      return Array.from(values, (value, k) => (Number.isNaN(value) || Number.isFinite(other?.[k]) ? null : value));
    };
    const data = [this.history.view("time"), ...this.definition.curves.map(column)];
    this.chart.setData(data);
  }
}

/** Title, unit and a key to the curves. */
function heading({ title, unit, curves }) {
  const caption = document.createElement("figcaption");
  const name = document.createElement("span");
  name.className = "title";
  name.append(term(title), " ");
  const inUnit = document.createElement("small");
  inUnit.textContent = unit;
  name.append(inUnit);
  caption.append(name, ...curves.filter(({ symbol }) => symbol).map(key));
  return caption;
}

function key({ name: curve, symbol, colour: name, width, dash, only }) {
  const item = document.createElement("span");
  item.className = `key ${only}`;
  item.dataset.curve = curve;
  const space = "http://www.w3.org/2000/svg";
  const swatch = document.createElementNS(space, "svg");
  swatch.setAttribute("viewBox", "0 0 18 8");
  swatch.setAttribute("aria-hidden", "true");
  const line = document.createElementNS(space, "path");
  const look = { d: "M0 4H18", "stroke-width": width, "stroke-dasharray": dash.join(" ") };
  for (const [attribute, value] of Object.entries(look)) line.setAttribute(attribute, value);
  line.style.stroke = `var(--${name})`;
  swatch.append(line);
  item.append(swatch, formula(symbol));
  return item;
}

export class Plots {
  /** `places`: pairs of definitions and the element that they belong into. */
  constructor(places, history) {
    this.shown = { history, rig: 0, duration: null, now: 0 };
    this.plots = places.flatMap(([definitions, parent]) => definitions.map((definition) => new Plot(definition, this.shown, parent)));
    this.due = 0;
    this.share = 1;
    this.last = performance.now();
  }

  /** A rail has no curves of cylinder 1. */
  setUp({ cylinders }) {
    for (const plot of this.plots) plot.setUp(cylinders);
  }

  /** Show the last seconds of a history, or, with a `duration`, s, all of it. */
  show(history, duration = null) {
    Object.assign(this.shown, { history, duration });
  }

  /** Redraw all of them, those out of sight too. */
  redraw() {
    for (const plot of this.plots) plot.redraw();
  }

  /** Redraw all that can be seen if that is due; called with each frame, whose time is `time`, s. */
  step(time, rig, now) {
    Object.assign(this.shown, { now: time, rig });
    const gap = now - this.last;
    this.last = now;
    this.share = gap > LATE ? Math.max(0.8 * this.share, LEAST_SHARE) : Math.min(this.share + 0.01, 1);
    this.due = Math.min(this.due + (RATE * this.share * gap) / 1e3, 1);
    if (this.due < 1) return;
    this.due = 0;
    for (const plot of this.plots) if (plot.visible) plot.redraw();
  }
}
