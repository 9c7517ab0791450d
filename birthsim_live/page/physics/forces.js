// Forces on the two pistons: what the air pushes with, and the friction that holds them back.

import * as pen from "../pen.js";
import { drawBar, drawEnds } from "./bars.js";

const RANGES = [20, 50, 100, 200, 500, 1000, 2000, 5000]; // N
const CALM = 0.35; // of the next smaller range: so small must all be for that to be shown

let range = RANGES[0];

/** Force of the air on the pistons, N, outwards (3): `areas` of chambers P1, N1, P2, N2. */
export function airForces(pressures, areas, atmosphere) {
  return [0, 2].map((i) => pressures[i] * areas[i] - pressures[i + 1] * areas[i + 1] - atmosphere * (areas[i] - areas[i + 1]));
}

function fit(most) {
  const least = RANGES.find((one) => most <= one) ?? RANGES.at(-1);
  const calm = RANGES.find((one) => most <= CALM * one) ?? RANGES.at(-1);
  range = Math.max(least, Math.min(range, calm));
}

const newtons = (value) => (Number.isFinite(value) ? `${value <= -0.5 ? "−" : value >= 0.5 ? "+" : " "}${Math.abs(value).toFixed(0)} N` : "–");

export function drawForces(context, width, { pressures, friction }, { areas, atmosphere, cylinders }) {
  const air = airForces(pressures, areas, atmosphere);
  fit(Math.max(...cylinders.flatMap((k) => [air[k], friction[k]]).map(Math.abs).filter(Number.isFinite), 0));
  cylinders.forEach((k, i) => {
    drawBar(context, width, 2 * i, `air ${k + 1}`, air[k] / range, newtons(air[k]), pen.colour("cylinder-1"));
    drawBar(context, width, 2 * i + 1, "friction", -friction[k] / range, newtons(-friction[k]), pen.FORCE);
  });
  drawEnds(context, width, 2 * cylinders.length, [`in ${range}`, "", `${range} N out`]);
}
