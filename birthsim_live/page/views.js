// What of the page is in sight: the story alone, with its lab, or, embedded in another page, the rig and its switch alone.

import { foldable } from "./fold.js";
import { embedded, wholePage } from "./link.js";

const LAB = "#lab";

export class Views {
  /** `change(settings)` asks the rig, `pause(wanted)` halts it. */
  constructor(change, pause) {
    this.button = document.getElementById("open-lab");
    this.button.addEventListener("click", () => this.toggle());
    this.choices = [...document.querySelectorAll("[name=under]")];
    this.other = document.getElementById("choose-other");
    for (const choice of this.choices) choice.addEventListener("change", () => change({ controller: choice.value }));
    if (embedded()) this.embed(pause);
    const whole = document.getElementById("whole");
    whole.addEventListener("click", () => {
      whole.href = wholePage();
    });
    foldable(document.getElementById("fold"), document.getElementById("handle"));
    addEventListener("hashchange", () => this.open(location.hash === LAB));
    this.open(location.hash === LAB);
  }

  /** Of several rigs in a long page only those in sight run. */
  embed(pause) {
    document.body.dataset.embed = "";
    new IntersectionObserver((entries) => pause(!entries.at(-1).isIntersecting)).observe(document.querySelector(".stage"));
  }

  /** A recording is looked at in the lab. */
  setUp({ mode, choices }) {
    this.titles = Object.fromEntries(choices.controller.map(({ name, title }) => [name, title]));
    this.open(mode !== "live" || location.hash === LAB);
  }

  toggle() {
    const wanted = !("lab" in document.body.dataset);
    history.replaceState(null, "", wanted ? LAB : location.pathname + location.search);
    this.open(wanted);
  }

  open(wanted) {
    document.body.toggleAttribute("data-lab", wanted);
    this.button.setAttribute("aria-expanded", String(wanted));
  }

  /** Which controller of the switch it is; one that is not there takes its last place. */
  show({ controller }) {
    const [input, words] = this.other.children;
    if (!this.choices.some((choice) => choice !== input && choice.value === controller)) {
      input.value = controller;
      words.textContent = this.titles[controller] ?? controller;
      this.other.hidden = false;
    }
    for (const choice of this.choices) choice.checked = choice.value === controller;
  }
}
