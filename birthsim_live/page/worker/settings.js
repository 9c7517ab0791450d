// What a person can set, and what is refused.

export const LEARNING = "learning"; // the controller that learns in the page
export const NOTHING = "nothing"; // to compare with
export const STIFFNESSES = ["Kclx", "Kcly", "Kpneu1", "Kpneu2"]; // instead of the scenario's setpoints, in the order of a reference

/** `changes` if all are allowed; else an error that names the setting, its value and what is allowed. */
export function checked(changes, { choices, ranges, defaults }) {
  for (const [name, value] of Object.entries(changes)) {
    const allowed = allowedFor(name, value, choices, ranges, defaults);
    if (allowed) throw new Error(`${name} = ${JSON.stringify(value)}; allowed: ${allowed}`);
  }
  const moved = STIFFNESSES.filter((name) => Object.hasOwn(changes, name)).join(", ");
  if (moved && changes.stiffness_source === "scenario") throw new Error(`stiffness_source = "scenario" beside ${moved}; allowed: one or the other`);
  return changes;
}

/** What is allowed, where `value` is not. */
function allowedFor(name, value, choices, ranges, defaults) {
  if (!Object.hasOwn(defaults, name)) return Object.keys(defaults).join(", ");
  if (name in ranges) {
    const { min, max, unit } = ranges[name];
    return typeof value === "number" && value >= min && value <= max ? "" : `${min} to ${max} ${unit}`;
  }
  if (name in choices) {
    const open = choices[name].filter(({ missing }) => !missing).map((choice) => choice.name ?? choice);
    return open.includes(value) ? "" : open.join(", ");
  }
  if (name === "stiffness_source") return ["scenario", "sliders"].includes(value) ? "" : "scenario, sliders";
  return typeof value === "boolean" ? "" : "true, false";
}

/** Settings after checked changes; moving a stiffness slider takes all setpoints over from the scenario. */
export function merged(settings, changes, setpoints) {
  const all = { ...changes };
  if (STIFFNESSES.some((name) => name in changes)) all.stiffness_source = "sliders";
  else if ("scenario" in changes) all.stiffness_source ??= "scenario";
  const taken = all.stiffness_source === "sliders" && settings.stiffness_source === "scenario";
  return { ...settings, ...(taken ? setpoints : {}), ...all };
}
