// Files of what is shown: numbers, a picture, and recordings that are opened by choice or dropped on the page.

import { SECOND, UNITS } from "./curves.js";
import { filmOf } from "./film.js";
import { pictureOf } from "./picture.js";

const byId = (id) => document.getElementById(id);

/** The plots' numbers as CSV: a column per curve, with its unit; nothing where there is no number, and no second rig that was not there. */
export function csvOf(history) {
  const names = Object.keys(UNITS).filter((name) => !name.startsWith(SECOND) || history.view(name).some(Number.isFinite));
  const columns = ["time", ...names].map((name) => history.view(name));
  const head = ["time (s)", ...names.map((name) => `${name} (${UNITS[name]})`)];
  const row = (_, k) => columns.map((column) => (Number.isFinite(column[k]) ? Number(column[k].toPrecision(7)) : "")).join(",");
  return [head.join(","), ...Array.from(columns[0], row)].join("\r\n").concat("\r\n");
}

function save(content, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10e3);
}

export class Files {
  /** `plots` are those of the page, `open(file)` plays a recording, `tell(words)` says what happened, `title()` what is shown. */
  constructor({ plots, open, tell, title }) {
    const menu = byId("files");
    const opener = document.querySelector("[popovertarget=files]");
    menu.addEventListener("toggle", ({ newState }) => {
      if (newState !== "open") return;
      const { left, bottom } = opener.getBoundingClientRect();
      menu.style.left = `${Math.max(0, Math.min(left, innerWidth - menu.offsetWidth - 4))}px`;
      menu.style.top = `${bottom + 4}px`;
    });
    const act = (id, doing) =>
      byId(id).addEventListener("click", async () => {
        menu.hidePopover();
        try {
          await doing();
        } catch ({ message }) {
          tell(message);
        }
      });
    act("copy-link", async () => {
      await navigator.clipboard.writeText(location.href);
      tell(`Copied: ${location.href}`);
    });
    act("save-film", async () => {
      tell("Filming for 5 s: pull the head.");
      save(await filmOf(document.querySelector(".view"), undefined, title()), "birthsim.webm");
    });
    act("save-csv", () => save(new Blob([csvOf(plots.shown.history)], { type: "text/csv" }), "birthsim.csv"));
    act("save-png", async () => {
      plots.redraw();
      save(await pictureOf(document.querySelector("main"), title()), "birthsim.png");
    });
    const choice = byId("choose");
    act("open-recording", () => choice.click());
    choice.addEventListener("change", () => {
      if (choice.files.length) open(choice.files[0]);
      choice.value = "";
    });
    this.listen(open);
  }

  listen(open) {
    const shade = byId("drop");
    const holds = (event) => event.dataTransfer?.types.includes("Files");
    addEventListener("dragover", (event) => {
      if (!holds(event)) return;
      event.preventDefault();
      shade.hidden = false;
    });
    addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) shade.hidden = true;
    });
    addEventListener("drop", (event) => {
      shade.hidden = true;
      if (!holds(event)) return;
      event.preventDefault();
      open(event.dataTransfer.files[0]);
    });
  }
}
