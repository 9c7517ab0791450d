// Openings of the spools, and the air that flows into the chambers.

import * as pen from "../pen.js";
import { drawBar, drawEnds } from "./bars.js";

const NAMES = ["P1", "N1", "P2", "N2"];
const GRAM = 1e3;

/** Grams per second, with a sign that tells in from out. */
function flow(value) {
  if (!Number.isFinite(value)) return "–";
  const grams = (GRAM * Math.abs(value)).toFixed(2);
  return `${Number(grams) === 0 ? " " : value < 0 ? "−" : "+"}${grams} g/s`;
}

export function drawValves(context, width, { openings, flows }) {
  NAMES.forEach((name, i) => {
    drawBar(context, width, i, name, openings[i], flow(flows[i]), pen.colour(openings[i] > 0 ? "cylinder-1" : "cylinder-2"));
  });
  drawEnds(context, width, NAMES.length, ["open air", "shut", "supply"]);
}
