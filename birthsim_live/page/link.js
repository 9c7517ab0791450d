// The settings as a link: the address names those that differ from what the page opens with.

import { STIFFNESSES } from "./worker/settings.js";

const EMBED = "embed"; // what an address says of the page itself
const NO = ["0", "false", "no"];
const GAP = 500; // ms between changes of the address; browsers allow a hundred in half a minute

/** Whether the address asks for the rig, its lens and its switch alone. */
export function embedded() {
  const asked = new URLSearchParams(location.search).get(EMBED);
  return asked !== null && !NO.includes(asked.toLowerCase());
}

/** The address of the whole page. */
export function wholePage() {
  const search = new URLSearchParams(location.search);
  search.delete(EMBED);
  return `${location.pathname}?${search}`;
}

/** The settings that an address asks for; what is no setting, or cannot be read as one, is refused by the rig, by name. */
export function settingsIn(search, defaults) {
  const asked = [...new URLSearchParams(search)].filter(([name]) => name !== EMBED);
  return Object.fromEntries(asked.map(([name, text]) => [name, read(text, typeof defaults[name])]));
}

/** A value of a type; the text itself where it is none. */
function read(text, type) {
  if (type === "boolean" && ["true", "false"].includes(text)) return text === "true";
  // Number("") is 0, and what is not finite would be null in a message.
  return type === "number" && text.trim() && Number.isFinite(Number(text)) ? Number(text) : text;
}

/** What stands in an address for settings. */
function searchOf(settings, defaults) {
  const given = settings.stiffness_source === "scenario" ? STIFFNESSES : [];
  const names = Object.keys(defaults).filter((name) => settings[name] !== defaults[name] && !given.includes(name));
  const kept = embedded() ? [[EMBED, "1"]] : [];
  const all = [...kept, ...names.map((name) => [name, settings[name]])];
  return all.length ? `?${new URLSearchParams(all)}` : "";
}

export class Link {
  setUp(defaults) {
    this.defaults = defaults;
    this.timer = null;
  }

  /** Let the address follow, soon. */
  show(settings) {
    this.settings = settings;
    this.timer ??= setTimeout(() => this.write(), GAP);
  }

  write() {
    this.timer = null;
    const search = searchOf(this.settings, this.defaults);
    if (search !== location.search) history.replaceState(null, "", location.pathname + search + location.hash);
  }
}
