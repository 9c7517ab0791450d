// Lists and sliders for everything that can be set while the rig runs.

import { NumberField } from "./slider.js";
import { STIFFNESSES } from "./worker/settings.js";

const LISTS = { scenario: "Scenario", controller: "Controller", compare: "Compare", valves: "Valves", sensors: "Sensors" };
const GROUPS = {
  "Rendered stiffness": { Kclx: ["along x ", ["K", "clx"]], Kcly: ["along y ", ["K", "cly"]] },
  "Pneumatic stiffness": { Kpneu1: ["cylinder 1 ", ["K", "pneu1"]], Kpneu2: ["cylinder 2 ", ["K", "pneu2"]] },
  "Law and rig": { damping: ["damping ", ["B"]], mass: ["mass ", ["M"]], friction: ["friction"] },
  "Your hand": { drag_stiffness: ["spring to the pointer"] },
};

// On a rail: one stiffness along it, which is asked for along x and y, and no cylinder 1.
const ON_RAIL = { ...GROUPS, "Rendered stiffness": { Kclx: ["along the rail ", ["K", "cl"]] }, "Pneumatic stiffness": { Kpneu2: [["K", "pneu"]] } };

export class Settings {
  /** `change(settings)` asks the rig; what it answers comes back through `show`. */
  constructor(form, change) {
    this.form = form;
    this.change = change;
    form.addEventListener("submit", (event) => event.preventDefault());
  }

  setUp({ choices, ranges, guide }) {
    this.form.replaceChildren();
    this.lists = {};
    this.fields = {};
    const lists = group("Experiment");
    for (const [name, title] of Object.entries(LISTS)) lists.append(this.list(name, title, choices[name]));
    this.about = document.createElement("p");
    this.about.className = "chosen";
    this.about.id = "chosen";
    lists.append(this.about, this.ownHand());
    this.form.append(lists);
    for (const [title, names] of Object.entries(guide ? ON_RAIL : GROUPS)) {
      const box = group(title);
      for (const name in names) {
        const others = guide && name === "Kclx" ? ["Kcly"] : [];
        const changes = (value) => Object.fromEntries([name, ...others].map((one) => [one, value]));
        this.fields[name] = new NumberField(name, names[name], ranges[name], (value) => this.change(changes(value)));
        box.append(this.fields[name].element);
      }
      if ("Kpneu2" in names) box.append(this.giveBack());
      this.form.append(box);
    }
  }

  list(name, title, choices) {
    const label = document.createElement("label");
    label.className = "list";
    const select = document.createElement("select");
    select.name = name;
    select.setAttribute("aria-describedby", "chosen");
    for (const { name: value, title: words, about, missing } of choices) {
      const option = new Option(missing ? `${words} (${missing})` : words, value);
      option.disabled = Boolean(missing);
      option.title = about;
      select.add(option);
    }
    select.addEventListener("change", () => this.change({ [name]: select.value }));
    for (const type of ["focus", "pointerenter"]) select.addEventListener(type, () => this.tell(name));
    label.append(title, select);
    this.lists[name] = select;
    return label;
  }

  /** Say what is chosen in a list. */
  tell(name) {
    this.told = name;
    const { options, selectedIndex } = this.lists[name];
    const words = options[selectedIndex]?.title ?? "";
    if (this.about.textContent !== words) this.about.textContent = words;
  }

  ownHand() {
    const label = document.createElement("label");
    label.className = "check";
    this.scenarioForce = document.createElement("input");
    this.scenarioForce.type = "checkbox";
    this.scenarioForce.name = "scenario_force";
    this.scenarioForce.addEventListener("change", () => this.change({ scenario_force: this.scenarioForce.checked }));
    label.append(this.scenarioForce, "the scenario's own pushes act too");
    return label;
  }

  giveBack() {
    this.source = document.createElement("button");
    this.source.type = "button";
    this.source.id = "stiffness-source";
    this.source.addEventListener("click", () => this.change({ stiffness_source: "scenario" }));
    return this.source;
  }

  show(settings) {
    for (const name in this.lists) this.lists[name].value = settings[name];
    this.tell(this.told ?? "controller");
    for (const name in this.fields) this.fields[name].show(settings[name]);
    this.scenarioForce.checked = settings.scenario_force;
    const own = settings.stiffness_source === "scenario";
    this.source.disabled = own;
    this.source.textContent = own ? "these are the scenario's setpoints" : "back to the scenario's setpoints";
    for (const name of STIFFNESSES) this.fields[name]?.element.classList.toggle("given", own);
    this.fields.damping.enable(settings.damping_applies, "this controller has no damping to set");
  }
}

function group(title) {
  const box = document.createElement("fieldset");
  const legend = document.createElement("legend");
  legend.textContent = title;
  box.append(legend);
  return box;
}
