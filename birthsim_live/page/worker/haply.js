// Messages of a Haply Inverse Service (3.1): what one says of the handle, or why it says nothing; and the force that it is told.

import { shown } from "../refusal.js";

const LONGEST = 2 ** 16; // characters of a message; the service's have some hundred
const LONGEST_ID = 100;
const FAR = 1; // m from the device's middle; its workspace has less than half of that

/** { id, x, z } of a handle: m to the right, and up. `known` is the id of the one that is used, or null. An Error says what is wrong. */
export function handleIn(data, known) {
  if (typeof data !== "string") throw new Error("a binary message; allowed: JSON");
  if (data.length > LONGEST) throw new Error(`a message of ${data.length} characters; allowed: up to ${LONGEST}`);
  const handles = parsed(data)?.inverse3;
  if (!Array.isArray(handles)) throw new Error("no inverse3; allowed: a list of devices");
  const handle = known === null ? handles[0] : handles.find((one) => one?.device_id === known);
  if (!handle) throw new Error(known === null ? "no Inverse3 is connected; allowed: one" : `device ${known} is gone; allowed: connected all the while`);
  const { device_id: id, state } = handle;
  if (typeof id !== "string" || !id || id.length > LONGEST_ID) throw new Error(`device_id = ${shown(id)}; allowed: some text`);
  const place = state?.cursor_position;
  const [x, z] = ["x", "z"].map((name) => {
    const value = place?.[name];
    if (typeof value === "number" && Math.abs(value) <= FAR) return value;
    throw new Error(`cursor_position.${name} = ${shown(value)}; allowed: -${FAR} to ${FAR} m`);
  });
  return { id, x, z };
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    throw new Error("a message that is no JSON; allowed: JSON");
  }
}

/** What tells the device `id` which force, N, to make: to the right, and up. */
export function forceFor(id, [x, z]) {
  return JSON.stringify({ inverse3: [{ device_id: id, commands: { set_cursor_force: { values: { x, y: 0, z } } } }] });
}
