// The numbers of an instant, as recordings hold them (birthsim_live/logs/recording.py), and what follows from them.

export const FIELDS = {
  time: 1, episode_time: 1, joints: 2, position: 2, velocity: 2, target: 2, compliant: 2, scenario_force: 2, drag_force: 2,
  pointer: 2, pressures: 4, openings: 4, stiffness: 2, pneumatic: 2, pneumatic_setpoint: 2, friction: 2, flows: 4,
};

export const CHAMBERS = ["P1", "N1", "P2", "N2"];

/** Which of CHAMBERS the cylinders have, that are counted from 0. */
export const chambersOf = (cylinders) => cylinders.flatMap((one) => [2 * one, 2 * one + 1]);

export const LEAST_FORCE = 5; // N and m: below them their quotient says nothing
export const LEAST_GIVEN = 1e-4;

/** An instant, name -> numbers in the order of FIELDS, as a frame: NaN where there is no number. */
export function frameOf(now, geometry) {
  const force = now.scenario_force.map((value, k) => value + now.drag_force[k]);
  const given = now.position.map((value, k) => value - now.target[k]);
  const off = now.position.map((value, k) => value - now.compliant[k]);
  const rendered = force.map((f, k) => {
    const says = Math.abs(f) >= LEAST_FORCE && Math.abs(given[k]) >= LEAST_GIVEN && f * given[k] > 0;
    return says ? f / given[k] : NaN;
  });
  const named = Object.entries(now).map(([name, values]) => [name, FIELDS[name] === 1 ? values[0] : values]);
  return {
    ...Object.fromEntries(named),
    pointer: now.pointer.every(Number.isFinite) ? now.pointer : null,
    force,
    error_mm: 1e3 * Math.hypot(...off),
    rendered,
    linkage: linkage(now.joints, geometry),
  };
}

/** Pivot 1, joint, pivot 2 and end effector, m; null where the linkage cannot close. */
function linkage([y1, y2], { d3, d6, k1, k2, gamma3 }) {
  const r4 = y1 + k1;
  const sine = (r4 * r4 - d3 * d3 - d6 * d6) / (2 * d3 * d6);
  if (!(Math.abs(sine) < 1)) return null;
  const tilt = gamma3 - Math.asin(sine);
  const at = (length) => [length * Math.sin(tilt), -length * Math.cos(tilt)];
  return [[d3 * Math.cos(gamma3), d3 * Math.sin(gamma3)], at(d6), [0, 0], at(k2 + y2)];
}
