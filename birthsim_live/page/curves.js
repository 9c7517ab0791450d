// What each plot shows: title, unit, curves with the paper's symbols, and how small its range may become.
// Dashes and luminance tell curves apart without colour.

import { COMPLIANT, END_EFFECTOR, FORCE, INK, TARGET } from "./pen.js";

const CYLINDER = ["rgb(14, 52, 128)", "rgb(112, 152, 216)"];
const LIGHT_FORCE = "rgb(232, 116, 150)";
const DASHED = [7, 4];
const DOTTED = [2, 3];
const MM = 1e3;
const BAR = 1e-5;

/** `symbol` is a formula, or null for a curve that shares the key of the one before. */
const curve = (name, symbol, colour, width, dash = []) => ({ name, symbol, colour, width, dash });
const setpoints = (names, colour) => names.map((name, i) => curve(name, i ? null : ["set"], colour, 1.5, DOTTED));

const coordinate = (axis) => ({
  title: `position ${axis}`,
  unit: "mm",
  least: 20,
  curves: [
    curve(`compliant_${axis}`, [[axis, "k"]], COMPLIANT, 4),
    curve(`position_${axis}`, [[axis, "c"]], END_EFFECTOR, 1.6),
    curve(`target_${axis}`, [[axis, "t"]], TARGET, 1.6, DASHED),
  ],
});

export const PLOTS = [
  coordinate("x"),
  coordinate("y"),
  {
    title: "user force",
    unit: "N",
    least: 20,
    curves: [curve("force_x", [["F", "us,x"]], FORCE, 1.8), curve("force_y", [["F", "us,y"]], LIGHT_FORCE, 1.8, DASHED)],
  },
  {
    title: "pressure",
    unit: "bar abs.",
    least: 2,
    curves: [0, 1].flatMap((i) => [
      curve(`P${i + 1}`, [["P", `p${i + 1}`]], CYLINDER[i], 1.8),
      curve(`N${i + 1}`, [["P", `n${i + 1}`]], CYLINDER[i], 1.8, DASHED),
    ]),
  },
  {
    title: "pneumatic stiffness",
    unit: "N/m",
    least: 1000,
    zero: true,
    curves: [
      ...[1, 2].map((i) => curve(`pneumatic_${i}`, [["K", `pneu${i}`]], CYLINDER[i - 1], 2)),
      ...setpoints(["pneumatic_setpoint_1", "pneumatic_setpoint_2"], INK),
    ],
  },
  {
    title: "rendered stiffness",
    unit: "N/m",
    least: 1000,
    zero: true,
    // Force over displacement runs away where the displacement passes through zero: the setpoints say what is worth seeing.
    follow: ["stiffness_x", "stiffness_y"],
    curves: [
      curve("rendered_x", [["F", "x"], "/Δ", ["x"]], INK, 1.8),
      curve("rendered_y", [["F", "y"], "/Δ", ["y"]], "rgb(214, 96, 20)", 1.8, DASHED),
      ...setpoints(["stiffness_x", "stiffness_y"], TARGET),
    ],
  },
];

export const NAMES = PLOTS.flatMap((plot) => plot.curves.map(({ name }) => name));

const number = (value) => value ?? NaN;

/** One row of the history, in the units of the plots. */
export function rowOf(frame) {
  const row = {};
  ["x", "y"].forEach((axis, i) => {
    row[`position_${axis}`] = MM * number(frame.position[i]);
    row[`target_${axis}`] = MM * number(frame.target[i]);
    row[`compliant_${axis}`] = MM * number(frame.compliant[i]);
    row[`force_${axis}`] = number(frame.force[i]);
    row[`stiffness_${axis}`] = number(frame.stiffness[i]);
    row[`rendered_${axis}`] = number(frame.rendered[i]);
    row[`pneumatic_${i + 1}`] = number(frame.pneumatic[i]);
    row[`pneumatic_setpoint_${i + 1}`] = number(frame.pneumatic_setpoint[i]);
  });
  ["P1", "N1", "P2", "N2"].forEach((name, i) => {
    row[name] = BAR * number(frame.pressures[i]);
  });
  return row;
}
