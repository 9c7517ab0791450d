// The panel "Physics": what makes the force that the hand feels. It draws only while it is open.

import { chambersOf } from "../frame.js";
import { Sheet } from "../sheet.js";
import { term } from "../terms.js";
import { Ellipse } from "./ellipse.js";
import { drawForces } from "./forces.js";
import { drawValves } from "./valves.js";
import { Work } from "./work.js";

const RATE = 20; // redraws per second
const FIGURES = [["power", "power of the hand", "W"], ["work", "work of the hand", "J"], ["stored", "the spring stores", "J"], ["rest", "the rig took", "J"]];

const signed = (value) => (Number.isFinite(value) ? `${value < -0.005 ? "−" : ""}${Math.abs(value).toFixed(2)}` : "–");

export class Physics {
  /** `section` is the panel, `button` what opens it. */
  constructor(section, button) {
    this.section = section;
    this.button = button;
    this.rigs = [0, 1].map(() => ({ ellipse: new Ellipse(), work: new Work() }));
    this.last = 0;
    const pictures = document.getElementById("pictures");
    this.sheets = ["valves and air", "forces in the cylinders", "stiffness at the head"].map((name) => picture(pictures, name));
    this.values = figures(pictures);
    button.addEventListener("click", () => this.open(section.hidden));
  }

  /** It takes the place of the plots. */
  open(wanted) {
    this.section.hidden = !wanted;
    document.getElementById("plots").hidden = wanted;
    this.button.setAttribute("aria-expanded", String(wanted));
  }

  setUp({ air, areas, cylinders }) {
    this.rig = { ...air, areas, cylinders, chambers: chambersOf(cylinders) };
  }

  push(frame) {
    [frame, frame.second].forEach((one, k) => {
      if (!one) return;
      this.rigs[k].work.push(one);
      this.rigs[k].ellipse.push(one);
    });
  }

  /** `frame` is that of rig `k`. */
  step(frame, k, now) {
    if (this.section.hidden || now - this.last < 1e3 / RATE) return;
    this.last = now;
    const { ellipse, work } = this.rigs[k];
    const draw = [
      (context, width) => drawValves(context, width, frame, this.rig),
      (context, width) => drawForces(context, width, frame, this.rig),
      (context, width, height) => ellipse.draw(context, width, height, frame),
    ];
    this.sheets.forEach((sheet, i) => {
      sheet.check();
      const { context, width, height } = sheet;
      if (!width) return;
      context.clearRect(0, 0, width, height);
      draw[i](context, width, height);
    });
    const found = work.figures(frame);
    FIGURES.forEach(([name], i) => {
      const words = signed(found[name]);
      if (this.values[i].textContent !== words) this.values[i].textContent = words;
    });
  }
}

function picture(parent, name) {
  const figure = document.createElement("figure");
  const caption = document.createElement("figcaption");
  caption.append(term(name));
  const canvas = document.createElement("canvas");
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", name);
  figure.append(caption, canvas);
  parent.append(figure);
  return new Sheet(canvas);
}

/** The numbers of the port; returns the elements of their digits. */
function figures(parent) {
  const figure = document.createElement("figure");
  const caption = document.createElement("figcaption");
  caption.append(term("work"));
  const list = document.createElement("dl");
  figure.append(caption, list);
  parent.append(figure);
  return FIGURES.map(([, title, unit]) => {
    const [name, value, digits, inUnit] = ["dt", "dd", "span", "small"].map((tag) => document.createElement(tag));
    name.textContent = title;
    inUnit.textContent = ` ${unit}`;
    value.append(digits, inUnit);
    const row = document.createElement("div");
    row.append(name, value);
    list.append(row);
    return digits;
  });
}
