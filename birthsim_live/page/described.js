// Settings in words, for pictures, films and recordings.

import { NOTHING, STIFFNESSES } from "./worker/settings.js";

const NAMED = ["scenario", "controller", "compare", "valves", "sensors"];

/** "probe · backstepping · ..."; `titles` are those of controllers, by name. */
export function inWords(settings, titles = {}) {
  const titled = (name) => (titles[name] ?? name).replaceAll("_", " ");
  const words = NAMED.filter((name) => typeof settings[name] === "string" && settings[name] !== NOTHING)
    .map((name) => `${name === "compare" ? "beside " : ""}${titled(settings[name])}`);
  const numbers = STIFFNESSES.filter((name) => Number.isFinite(settings[name])).map((name) => `${name} ${settings[name]} N/m`);
  const rig = [["mass", "mass %s kg"], ["friction", "friction × %s"]].filter(([name]) => Number.isFinite(settings[name]));
  return [...words, ...numbers, ...rig.map(([name, text]) => text.replace("%s", settings[name]))].join(" · ");
}
