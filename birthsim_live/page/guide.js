// Things to try, one after the other: settings, two sentences, and where to look. Some say something else on a rail, or are not for one.

const LESSONS = [
  {
    name: "Feel the friction",
    says: "Compressed air carries the head of a childbirth simulator, and a controller should make it feel like a spring. Pull it and hold: the controller pushes against friction, and it shakes by millimetres.",
    onRail: "Compressed air moves the carriage of a bench, and a controller should make it feel like a spring. Pull it and hold: the controller pushes against friction, and the carriage shakes.",
    settings: {},
    look: ".lens",
  },
  {
    name: "Take the friction away",
    says: "It shakes more, by a centimetre: the pistons slide freely, but the controller still pushes against the friction that it expects. One that expected none would hold still; nobody knows friction exactly.",
    linkageAlone: true,
    settings: { friction: 0 },
    look: "[data-figure=error]",
  },
  {
    name: "Halve the stiffness",
    says: "Pull as hard as before: the head gives way almost twice as far. The softer the spring, the more of its stiffness is friction.",
    settings: { Kclx: 1000, Kcly: 1000 },
    look: ".felt",
  },
  {
    name: "What the force sensor buys",
    says: "The first controller measures the hand's force and moves the head to where the spring would be; the second is the paper's. Pull either head: only the first dot stays on its diamond.",
    settings: { controller: "admittance-backstepping", compare: "backstepping" },
    look: ".rigs",
  },
  {
    name: "What learning adds",
    says: "Both rigs are heavier and rougher than their controllers believe. A trained policy corrects the first; the paper's controller alone errs about four times as much.",
    settings: { scenario: "circle", controller: "residual:circle", compare: "backstepping", scenario_force: true, mass: 4, friction: 1.5 },
    look: ".second figcaption",
  },
  {
    name: "Learn it here",
    says: "This network opens the valves, and knows nothing yet: they stay shut. Let it practise on 32 randomised rigs, whose derivatives say what to change. The rig that you see runs what it knows.",
    settings: { scenario: "circle", controller: "learning", scenario_force: true },
    look: ".learning",
  },
  {
    name: "Forceps pull",
    says: "Pulls of 175 N act on the head, as in a forceps delivery. The controller holds it with 4000 N/m; pull along and feel how far that gives way.",
    settings: { scenario: "forceps", controller: "admittance-backstepping", scenario_force: true },
    look: "[data-figure='user force']",
  },
];
const OWN = { name: "Your own settings", says: "Pull the head: the difference between dot and diamond is the error.", look: ".lens" };

const BASE = ["scenario", "controller", "compare", "valves", "sensors", "scenario_force", "damping", "mass", "friction"];

export class Guide {
  /** `change(settings)` asks the rig. */
  constructor(change) {
    this.change = change;
    this.list = document.getElementById("guide");
    this.words = document.getElementById("lesson");
    this.list.addEventListener("change", () => this.go(LESSONS[this.list.selectedIndex]));
    document.getElementById("next").addEventListener("click", () => this.next());
  }

  setUp({ choices, defaults, guide }) {
    this.rail = Boolean(guide);
    this.defaults = Object.fromEntries(BASE.map((name) => [name, defaults[name]]));
    const open = (kind, name) => !name || choices[kind].some((one) => one.name === name && !one.missing);
    this.list.replaceChildren(...[...LESSONS, OWN].map(({ name }) => new Option(name)));
    LESSONS.forEach(({ settings: { controller, scenario }, linkageAlone }, k) => {
      this.list.options[k].disabled = !open("controller", controller) || !open("scenario", scenario) || (this.rail && Boolean(linkageAlone));
    });
    this.list.options[LESSONS.length].disabled = true;
    this.lesson = null;
  }

  /** The settings of a lesson: those that the page opens with, but for its own. */
  settingsOf({ settings }) {
    return { ...this.defaults, ...("Kclx" in settings ? {} : { stiffness_source: "scenario" }), ...settings };
  }

  go(lesson) {
    this.change(this.settingsOf(lesson));
  }

  next() {
    const open = LESSONS.filter((_, k) => !this.list.options[k].disabled);
    this.go(open[(open.indexOf(this.lesson) + 1) % open.length]);
  }

  /** Tell what the settings are an example of. */
  show(settings) {
    const fits = (lesson) => Object.entries(this.settingsOf(lesson)).every(([name, value]) => settings[name] === value);
    const lesson = LESSONS.find(fits) ?? OWN;
    if (lesson === this.lesson) return;
    this.lesson = lesson;
    this.list.value = lesson.name;
    this.words.textContent = (this.rail && lesson.onRail) || lesson.says;
    document.querySelector(".look")?.classList.remove("look");
    document.querySelector(lesson.look)?.classList.add("look");
  }
}
