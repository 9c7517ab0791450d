// Openings of the spools, and the air that flows into the chambers.

import * as pen from "../pen.js";
import { CHAMBERS } from "../frame.js";
import { drawBar, drawEnds } from "./bars.js";

const GRAM = 1e3;

/** Grams per second, with a sign that tells in from out. */
function flow(value) {
  if (!Number.isFinite(value)) return "–";
  const grams = (GRAM * Math.abs(value)).toFixed(2);
  return `${Number(grams) === 0 ? " " : value < 0 ? "−" : "+"}${grams} g/s`;
}

/** Of the `chambers` that there are, indices of CHAMBERS. */
export function drawValves(context, width, { openings, flows }, { chambers }) {
  chambers.forEach((k, i) => {
    drawBar(context, width, i, CHAMBERS[k], openings[k], flow(flows[k]), pen.colour(openings[k] > 0 ? "cylinder-1" : "cylinder-2"));
  });
  drawEnds(context, width, chambers.length, ["open air", "shut", "supply"]);
}
