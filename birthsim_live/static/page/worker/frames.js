// What a frame shows (birthsim_live/rig/frames.py): a row of numbers per instant, and named on its way to the page.

export const FIELDS = {
  time: 1, episode_time: 1, joints: 2, position: 2, velocity: 2, target: 2, compliant: 2, scenario_force: 2, drag_force: 2,
  pointer: 2, pressures: 4, openings: 4, stiffness: 2, pneumatic: 2, pneumatic_setpoint: 2, friction: 2,
  flows: 4,
};

const INFO = {
  joints: "piston_position", position: "position", velocity: "velocity", target: "target", compliant: "compliant_target",
  pressures: "pressure", openings: "opening", stiffness: "stiffness_setpoint", pneumatic: "pneumatic_stiffness",
  pneumatic_setpoint: "pneumatic_stiffness_setpoint", friction: "friction", flows: "flows",
};

const NOWHERE = [NaN, NaN];

/** The present instant: name -> numbers, in the order of FIELDS. */
export function instant(session) {
  const { show, seen, world, pack, hands } = session;
  show.run(seen, world);
  const known = {
    time: [session.time],
    episode_time: [session.episodeTime],
    scenario_force: hands.scenarioNow,
    drag_force: hands.dragNow,
    pointer: hands.pointer ?? NOWHERE,
  };
  return Object.fromEntries(Object.keys(FIELDS).map((name) => [name, known[name] ?? show.memory.some(...pack.info[INFO[name]])]));
}

/** The present instant as a row of numbers. */
export function rowOf(session) {
  return Float64Array.from(Object.values(instant(session)).flat());
}

/** The same of a rig that is not there. */
export const NO_ROW = new Float64Array(Object.values(FIELDS).reduce((sum, size) => sum + size)).fill(NaN);

const told = (value) => (Number.isFinite(value) ? value : null);

/** The present instant as the page shows it; `second` is that of the rig beside it, or null. */
export function frameOf(session) {
  const { second } = session;
  if (second) second.hands.hold = session.hands.hold; // in a pause too
  return { ...shown(session), second: second && shown(second) };
}

/** One rig, null where there is no number. */
function shown(session) {
  const now = instant(session);
  const { numbers, hands, pack } = session;
  const force = now.scenario_force.map((value, k) => value + now.drag_force[k]);
  const given = now.position.map((value, k) => value - now.target[k]);
  const off = now.position.map((value, k) => value - now.compliant[k]);
  const rendered = force.map((f, k) => {
    const says = Math.abs(f) >= numbers.least_force && Math.abs(given[k]) >= numbers.least_given && f * given[k] > 0;
    return says ? f / given[k] : null;
  });
  const named = Object.entries(now).map(([name, values]) => [name, FIELDS[name] === 1 ? told(values[0]) : values.map(told)]);
  return {
    ...Object.fromEntries(named),
    pointer: hands.pointer,
    force: force.map(told),
    error_mm: told(1e3 * Math.hypot(...off)),
    rendered: rendered.map(told),
    linkage: linkage(now.joints, pack.hello.geometry),
    pointer_id: hands.used,
    lost: session.lost,
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
