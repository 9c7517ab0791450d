// What a frame shows: a row of numbers per instant, and named on its way to the page.

import { FIELDS, frameOf as completed } from "../frame.js";

/** The present instant: name -> numbers, in the order of FIELDS. */
export function instant(session) {
  const { pack, hands } = session;
  const info = session.shown();
  const { guide } = pack.hello;
  const known = {
    time: [session.time],
    episode_time: [session.episodeTime],
    scenario_force: borne(session.some("scenario_force_x", 2), guide),
    drag_force: borne(session.some("pointer_force_x", 2), guide),
    pointer: hands.pointer(session.some("x", 2), session.loop.get("pointer_stiffness")),
  };
  const of = (name) => {
    const [first, count] = pack.info[name];
    return Array.from(info.subarray(first, first + count));
  };
  return Object.fromEntries(Object.keys(FIELDS).map((name) => [name, known[name] ?? of(name)]));
}

/** What of a force acts along a rail's guide. */
function borne(force, guide) {
  if (!guide) return force;
  const along = force[0] * guide[0] + force[1] * guide[1];
  return guide.map((part) => along * part);
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
