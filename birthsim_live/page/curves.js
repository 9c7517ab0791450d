// What each plot shows: title, unit, curves with the paper's symbols, and how small its range may become.
// Dashes and luminance tell curves apart without colour.

import { CHAMBERS } from "./frame.js";

const CYLINDER = ["cylinder-1", "cylinder-2"];
const DASHED = [7, 4];
const DOTTED = [2, 3];
const MM = 1e3;
const BAR = 1e-5;

/**
 * `symbol` is a formula, or null for a curve that shares the key of the one before; `colour` is a name of colours.css; `only`
 * is the class of what belongs to one rig or to two, `unless` a curve that takes its place where that has numbers, `cylinder` the
 * one that it is of, counted from 0. A plot that
 * is `common` shows both rigs; the others show one, and the names of the second's curves begin with SECOND.
 */
const curve = (name, symbol, colour, width, dash = [], { only = "", unless, cylinder } = {}) => ({ name, symbol, colour, width, dash, only, unless, cylinder });
const setpoints = (names, colour, of = () => ({})) => names.map((name, i) => curve(name, i ? null : ["set"], colour, 1.5, DOTTED, of(i)));

const coordinate = (axis) => ({
  title: `position ${axis}`,
  unit: "mm",
  least: 20,
  curves: [
    curve(`compliant_${axis}`, [[axis, "k"]], "compliant", 4),
    curve(`position_${axis}`, [[axis, "c"]], "end-effector", 1.6),
    curve(`target_${axis}`, [[axis, "t"]], "target", 1.6, DASHED),
  ],
});

/** Always in sight. */
export const PLOTS = [
  {
    title: "error",
    unit: "mm",
    least: 2,
    zero: true,
    common: true,
    curves: [
      curve("error", [["e"]], "force", 1.8),
      curve("error_rms", ["RMS of 2 s"], "ink", 1.6, DASHED, { only: "one-only", unless: "second_error" }),
      curve("second_error", ["second"], "beside", 1.6, DASHED, { only: "two-only" }),
    ],
  },
  coordinate("x"),
  coordinate("y"),
  {
    title: "user force",
    unit: "N",
    least: 20,
    curves: [curve("force_x", [["F", "us,x"]], "force", 1.8), curve("force_y", [["F", "us,y"]], "force-light", 1.8, DASHED)],
  },
  {
    title: "pressure",
    unit: "bar abs.",
    least: 2,
    curves: [0, 1].flatMap((i) => [
      curve(`P${i + 1}`, [["P", `p${i + 1}`]], CYLINDER[i], 1.8, [], { cylinder: i }),
      curve(`N${i + 1}`, [["P", `n${i + 1}`]], CYLINDER[i], 1.8, DASHED, { cylinder: i }),
    ]),
  },
  {
    title: "rendered stiffness",
    unit: "N/m",
    least: 1000,
    zero: true,
    // Force over displacement runs away where the displacement passes through zero: the setpoints say what is worth seeing.
    follow: ["stiffness_x", "stiffness_y"],
    curves: [
      curve("rendered_x", [["F", "x"], "/Δ", ["x"]], "ink", 1.8),
      curve("rendered_y", [["F", "y"], "/Δ", ["y"]], "second", 1.8, DASHED),
      ...setpoints(["stiffness_x", "stiffness_y"], "target"),
    ],
  },
];

/** Beside the pictures of the physics. */
export const DEEPER = [
  {
    title: "power",
    unit: "W",
    least: 2,
    curves: [curve("power", [["P"]], "force", 1.8)],
  },
  {
    title: "pneumatic stiffness",
    unit: "N/m",
    least: 1000,
    zero: true,
    curves: [
      ...[1, 2].map((i) => curve(`pneumatic_${i}`, [["K", `pneu${i}`]], CYLINDER[i - 1], 2, [], { cylinder: i - 1 })),
      ...setpoints(["pneumatic_setpoint_1", "pneumatic_setpoint_2"], "ink", (i) => ({ cylinder: i })),
    ],
  },
];

export const SECOND = "second_";

/** Running errors of both rigs. */
export const RMS = ["error_rms", `${SECOND}error_rms`];

const own = [...PLOTS, ...DEEPER].flatMap(({ unit, curves }) => curves.map(({ name }) => [name, unit])).filter(([name]) => !name.startsWith(SECOND));

/** Name of a curve -> its unit; those of the second rig follow those of the first. */
export const UNITS = Object.fromEntries([...own, ...own.map(([name, unit]) => [SECOND + name, unit])]);

/** One row of the history, in the units of the plots; `rms` are the running errors of both rigs (rms.js). */
export function rowOf(frame, rms) {
  const second = frame.second ? rowOfOne(frame.second, rms[1].value) : {};
  return { ...rowOfOne(frame, rms[0].value), ...Object.fromEntries(own.map(([name]) => [SECOND + name, second[name] ?? NaN])) };
}

function rowOfOne(frame, rms) {
  const [vx, vy] = frame.velocity;
  const row = {
    error: frame.error_mm,
    error_rms: rms,
    power: frame.force[0] * vx + frame.force[1] * vy,
  };
  ["x", "y"].forEach((axis, i) => {
    row[`position_${axis}`] = MM * frame.position[i];
    row[`target_${axis}`] = MM * frame.target[i];
    row[`compliant_${axis}`] = MM * frame.compliant[i];
    row[`force_${axis}`] = frame.force[i];
    row[`stiffness_${axis}`] = frame.stiffness[i];
    row[`rendered_${axis}`] = frame.rendered[i];
    row[`pneumatic_${i + 1}`] = frame.pneumatic[i];
    row[`pneumatic_setpoint_${i + 1}`] = frame.pneumatic_setpoint[i];
  });
  CHAMBERS.forEach((name, i) => {
    row[name] = BAR * frame.pressures[i];
  });
  return row;
}
