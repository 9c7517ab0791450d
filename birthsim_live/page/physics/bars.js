// Bars from a middle line, to the right where a number is above zero.

import * as pen from "../pen.js";

export const ROW = 19; // px
const LEFT = 54; // px for names
const RIGHT = 62; // px for numbers

/** Draws a row: its name, a bar for `share` from -1 to 1, and a number. */
export function drawBar(context, width, row, name, share, figure, colour) {
  const [left, room, top] = [LEFT, width - LEFT - RIGHT, row * ROW];
  const middle = left + room / 2;
  context.fillStyle = pen.FAINT;
  context.fillRect(left, top + 4, room, ROW - 8);
  if (Number.isFinite(share)) {
    const length = (Math.min(Math.max(share, -1), 1) * room) / 2;
    context.fillStyle = colour;
    context.fillRect(Math.min(middle, middle + length), top + 4, Math.abs(length), ROW - 8);
  }
  context.fillStyle = pen.INK;
  context.fillRect(middle - 0.75, top + 1, 1.5, ROW - 2);
  context.textBaseline = "middle";
  context.font = `600 12px ${pen.FONT}`;
  context.textAlign = "left";
  context.fillText(name, 0, top + ROW / 2);
  context.textAlign = "right";
  context.fillText(figure, width, top + ROW / 2);
}

/** A line of small words below the bars: on their left, in the middle and on their right. */
export function drawEnds(context, width, row, words) {
  const places = [0, LEFT + (width - LEFT - RIGHT) / 2, width];
  context.font = `500 11px ${pen.FONT}`;
  context.fillStyle = pen.INK;
  context.textBaseline = "middle";
  words.forEach((text, k) => {
    context.textAlign = ["left", "center", "right"][k];
    context.fillText(text, places[k], row * ROW + 8);
  });
}
