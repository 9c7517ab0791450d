// What a frame shows (birthsim_live/rig/frames.py): a row of numbers per instant, and named on its way to the page.

import { FIELDS, frameOf as completed } from "../frame.js";

const INFO = {
  joints: "piston_position", position: "position", velocity: "velocity", target: "target", compliant: "compliant_target",
  pressures: "pressure", openings: "opening", stiffness: "stiffness_setpoint", pneumatic: "pneumatic_stiffness",
  pneumatic_setpoint: "pneumatic_stiffness_setpoint", friction: "friction", flows: "flows",
};

/** The present instant: name -> numbers, in the order of FIELDS. */
export function instant(session) {
  const { show, seen, world, inputs, rows, pack, hands } = session;
  show.run(seen, world);
  const known = {
    time: [session.time],
    episode_time: [session.episodeTime],
    scenario_force: inputs.some(rows.inputs.scenario_force, 2),
    drag_force: inputs.some(rows.inputs.pointer_force, 2),
    pointer: hands.pointer(world.some(rows.MOTION, 2), inputs.get(rows.inputs.pointer_stiffness)),
  };
  return Object.fromEntries(Object.keys(FIELDS).map((name) => [name, known[name] ?? show.memory.some(...pack.info[INFO[name]])]));
}

/** The present instant as a row of numbers. */
export function rowOf(session) {
  return Float64Array.from(Object.values(instant(session)).flat());
}

/** The same of a rig that is not there. */
export const NO_ROW = new Float64Array(Object.values(FIELDS).reduce((sum, size) => sum + size)).fill(NaN);

/** The present instant as the page shows it; `second` is that of the rig beside it, or null. */
export function frameOf(session) {
  const { second } = session;
  if (second) second.hands.hold = session.hands.hold; // in a pause too
  return { ...shown(session), second: second && shown(second) };
}

function shown(session) {
  return {
    ...completed(instant(session), session.pack.hello.geometry),
    pointer_id: session.hands.used,
    lost: session.lost,
  };
}
