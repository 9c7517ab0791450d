// Draws each entry of the legend with the very functions that draw the rig.

import * as pen from "./pen.js";
import { Pen } from "./pen.js";
import { Sheet } from "./sheet.js";

const line = (context, points, colour, px) => {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.strokeStyle = colour;
  context.lineWidth = px;
  context.stroke();
};

const SYMBOLS = {
  "end-effector": (world, at) => pen.endEffectorMarker(world, at, 4),
  compliant: (world, at) => pen.compliantMarker(world, at, 5.5),
  target: (world, at) => pen.targetMarker(world, at, 5),
  path: ({ context }, [x, y]) => line(context, [[x - 11, -y], [x + 11, -y]], pen.PATH, 2),
  force: ({ context }, [x, y]) => pen.arrow(context, [x - 11, -y], [x + 11, -y], 3.5),
  spring: ({ context }, [x, y]) => {
    const zigzag = [[-11, 0], [-8, 0], [-6, 4], [-3, -4], [0, 4], [3, -4], [5, 0], [7, 0]];
    line(context, zigzag.map(([dx, dy]) => [x + dx, -y + dy]), pen.CAP, 1.5);
    new Pen(context, [0, 0], 1).disc([x + 8, y], 3, pen.PAPER, pen.CAP, 1.5);
  },
};

export function drawLegend(root) {
  for (const canvas of root.querySelectorAll("canvas[data-symbol]")) {
    const changed = (width, height) => {
      const world = new Pen(canvas.getContext("2d"), [0, 0], 1);
      SYMBOLS[canvas.dataset.symbol](world, [width / 2, -height / 2]);
    };
    new Sheet(canvas, { changed });
  }
}
