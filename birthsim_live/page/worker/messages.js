// Messages of the page, to a rig that is live or recorded: each is checked before anything is done.

import { layersOf } from "../learning/network.js";
import { near, shown } from "../refusal.js";

const isFinite = (values) => Array.from(values).every(Number.isFinite);
const isList = (value) => Array.isArray(value) || ArrayBuffer.isView(value);
const isPair = (value) => Array.isArray(value) && value.length === 2 && isFinite(value);
const isObject = (value) => typeof value === "object" && value !== null && !isList(value);
const TRUTH = [(value) => typeof value === "boolean", "true, false"];

/** Whether weights, mean and deviation of a network are as many as its widths say, and numbers. */
function isNetwork(value) {
  const { widths, weights, mean, deviation } = value ?? {};
  if (![widths, weights, mean, deviation].every((one) => isList(one) && isFinite(one)) || widths.length < 2) return false;
  return layersOf(widths).at(-1).end === weights.length && [mean, deviation].every(({ length }) => length === widths[0]);
}

/** Type -> field -> what a value must be, and in words; `hello` and `numbers` are the rig's. */
const FIELDS = {
  drag: () => ({ position: [isPair, "two numbers, m"] }),
  push: ({ drag_limit: most }) => ({ force: [(value) => isPair(value) && Math.hypot(...value) <= most, `two numbers, up to ${most} N together`] }),
  release: () => ({}),
  device: () => ({ on: TRUTH }),
  hidden: () => ({ hidden: TRUTH }),
  learned: () => ({ network: [isNetwork, "widths, and as many weights, means and deviations"] }),
  set: () => ({ settings: [isObject, "settings by name"] }),
  pause: () => ({ paused: TRUTH }),
  speed: (_, { slowest }) => ({ speed: [(value) => value >= slowest && value <= 1, `${slowest} to 1 times real time`] }),
  reset: () => ({}),
  record: () => ({ on: TRUTH }),
  seek: () => ({ time: [Number.isFinite, "a time, s"] }),
};

/** `message`, where it is one of `types` with all of its fields; else an error that names the field and what is allowed. */
export function checkedMessage(message, types, hello, numbers) {
  const type = message?.type;
  if (!types.includes(type)) throw new Error(`message = ${shown(type)}${near(type, types)}; allowed here: ${types.join(", ")}`);
  for (const [name, [fits, allowed]] of Object.entries(FIELDS[type](hello, numbers))) {
    if (!fits(message[name])) throw new Error(`${name} = ${shown(message[name])} of ${type}; allowed: ${allowed}`);
  }
  return message;
}
