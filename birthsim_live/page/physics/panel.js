// The panel "Physics": what makes the force that the hand feels. It draws only while it is open.

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
    this.ellipse = new Ellipse();
    this.work = new Work();
    this.last = 0;
    const pictures = document.createElement("div");
    pictures.className = "pictures";
    this.sheets = ["valves and air", "forces in the cylinders", "stiffness at the head"].map((name) => picture(pictures, name));
    this.values = figures(pictures);
    section.prepend(pictures);
    button.addEventListener("click", () => this.open(section.hidden));
  }

  open(wanted) {
    this.section.hidden = !wanted;
    this.button.setAttribute("aria-expanded", String(wanted));
  }

  setUp({ air, areas }) {
    this.rig = { ...air, areas };
  }

  push(frame) {
    this.work.push(frame);
    this.ellipse.push(frame);
  }

  step(frame, now) {
    if (this.section.hidden || now - this.last < 1e3 / RATE) return;
    this.last = now;
    const draw = [
      (context, width) => drawValves(context, width, frame),
      (context, width) => drawForces(context, width, frame, this.rig),
      (context, width, height) => this.ellipse.draw(context, width, height, frame),
    ];
    this.sheets.forEach((sheet, k) => {
      sheet.check();
      const { context, width, height } = sheet;
      if (!width) return;
      context.clearRect(0, 0, width, height);
      draw[k](context, width, height);
    });
    const found = this.work.figures(frame);
    FIGURES.forEach(([name], k) => {
      const words = signed(found[name]);
      if (this.values[k].textContent !== words) this.values[k].textContent = words;
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

/** The figures of the port; returns the elements of their digits. */
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
