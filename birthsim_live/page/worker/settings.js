// What a person can set, and what is refused.

import { listed, near, shown } from "../refusal.js";

export const LEARNING = "learning"; // the controller that learns in the page
export const NOTHING = "nothing"; // to compare with
export const STIFFNESSES = ["Kclx", "Kcly", "Kpneu1", "Kpneu2"]; // instead of the scenario's setpoints, in the order of a reference
const SOURCES = ["scenario", "sliders"]; // of the setpoints

/** `changes` if all are allowed; else an error that names the setting, its value and what is allowed. */
export function checked(changes, hello) {
  const [refusal] = sifted(changes, hello).refusals;
  if (refusal) throw new Error(refusal);
  return changes;
}

/** What of `changes` is allowed, and why the others are refused: { allowed, refusals }. */
export function sifted(changes, hello) {
  const refused = Object.entries(changes).map(([name, value]) => [name, refusalOf(name, value, hello)]);
  const moved = STIFFNESSES.filter((name) => Object.hasOwn(changes, name)).join(", ");
  if (moved && changes.stiffness_source === "scenario") {
    refused.push(["stiffness_source", `stiffness_source = "scenario" beside ${moved}; allowed: one or the other`]);
  }
  const bad = new Map(refused.filter(([, refusal]) => refusal));
  return { allowed: Object.fromEntries(Object.entries(changes).filter(([name]) => !bad.has(name))), refusals: [...bad.values()] };
}

/** Why a setting cannot have a value, or an empty string. */
function refusalOf(name, value, { choices, ranges, defaults }) {
  const names = Object.keys(defaults);
  if (!Object.hasOwn(defaults, name)) return `${shown(name)} = ${shown(value)}: no such setting${near(name, names)}; allowed: ${names.join(", ")}`;
  const refused = (words, like = "") => `${name} = ${shown(value)}${like}; allowed: ${words}`;
  if (Object.hasOwn(ranges, name)) {
    const { min, max, unit } = ranges[name];
    return typeof value === "number" && value >= min && value <= max ? "" : refused(`${min} to ${max} ${unit}`);
  }
  if (Object.hasOwn(choices, name)) {
    const open = choices[name].filter(({ missing }) => !missing).map((choice) => choice.name);
    return open.includes(value) ? "" : refused(listed(open), near(value, open));
  }
  if (name === "stiffness_source") return SOURCES.includes(value) ? "" : refused(SOURCES.join(", "), near(value, SOURCES));
  return typeof value === "boolean" ? "" : refused("true, false");
}

/** Settings after checked changes; moving a stiffness slider takes all setpoints over from the scenario. */
export function merged(settings, changes, setpoints) {
  const all = { ...changes };
  if (STIFFNESSES.some((name) => name in changes)) all.stiffness_source = "sliders";
  else if ("scenario" in changes) all.stiffness_source ??= "scenario";
  const taken = all.stiffness_source === "sliders" && settings.stiffness_source === "scenario";
  return { ...settings, ...(taken ? setpoints : {}), ...all };
}
