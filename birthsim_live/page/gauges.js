// One bar per chamber that there is, on the scale of the air's colours, from atmospheric to supply pressure.

import { CHAMBERS, chambersOf } from "./frame.js";
import * as pen from "./pen.js";
import { Sheet } from "./sheet.js";

const ROW = 17;
const RATE = 15; // redraws per second: nobody sees more of a bar

export class Gauges {
  constructor(canvas) {
    this.sheet = new Sheet(canvas);
    this.last = 0;
  }

  setUp({ air, cylinders }) {
    Object.assign(this, { air, chambers: chambersOf(cylinders) });
  }

  step(pressures, now) {
    if (now - this.last < 1e3 / RATE) return;
    this.last = now;
    this.sheet.check();
    this.draw(pressures);
  }

  draw(pressures) {
    const { context, width, height } = this.sheet;
    if (!width || !this.air) return;
    const { supply, atmosphere } = this.air;
    const [left, room] = [26, width - 26 - 34];
    context.clearRect(0, 0, width, height);
    context.font = `600 12px ${pen.FONT}`;
    context.textBaseline = "middle";
    this.chambers.forEach((chamber, i) => {
      const pressure = pressures[chamber];
      const share = (pressure - atmosphere) / (supply - atmosphere);
      const top = i * ROW;
      const length = Math.min(Math.max(share, 0), 1) * room;
      context.fillStyle = pen.FAINT;
      context.fillRect(left, top + 2, room, ROW - 6);
      if (Number.isFinite(share)) {
        context.fillStyle = pen.CAP;
        context.fillRect(left, top + 2, Math.min(length + 1, room), ROW - 6);
        context.fillStyle = pen.airColour(share);
        context.fillRect(left, top + 3, length, ROW - 8);
      }
      context.fillStyle = pen.INK;
      context.textAlign = "left";
      context.fillText(CHAMBERS[chamber], 0, top + ROW / 2);
      context.textAlign = "right";
      context.fillText(Number.isFinite(pressure) ? (pressure / 1e5).toFixed(2) : "–", width, top + ROW / 2);
    });
    this.drawScale(left, room, this.chambers.length * ROW + 2);
  }

  drawScale(left, room, top) {
    const { context } = this.sheet;
    const ramp = context.createLinearGradient(left, 0, left + room, 0);
    for (let i = 0; i <= 4; i += 1) ramp.addColorStop(i / 4, pen.airColour(i / 4));
    context.fillStyle = ramp;
    context.fillRect(left, top, room, 7);
    context.strokeStyle = pen.CAP;
    context.lineWidth = 1;
    context.strokeRect(left + 0.5, top + 0.5, room - 1, 6);
    context.fillStyle = pen.INK;
    context.font = `500 11px ${pen.FONT}`;
    context.textAlign = "left";
    context.fillText((this.air.atmosphere / 1e5).toFixed(1), left, top + 15);
    context.textAlign = "right";
    context.fillText((this.air.supply / 1e5).toFixed(1), left + room, top + 15);
  }
}
