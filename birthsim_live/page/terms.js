// Names that explain themselves: a button that opens a sentence or two. The sentences come with the greeting.

const GAP = 6; // px between a name and what explains it

let sentences = {};
let opener = null;

const box = document.getElementById("explanation");

/** A name that can be asked what it means. */
export function term(name) {
  const button = document.createElement("button");
  Object.assign(button, { type: "button", className: "term", textContent: name });
  button.addEventListener("click", () => (button === opener ? box.hidePopover() : open(button, name)));
  return button;
}

/** `figures`: name -> what it shows. */
export function explain(figures) {
  sentences = figures;
}

function open(button, name) {
  if (!sentences[name]) return;
  box.textContent = sentences[name];
  box.showPopover();
  opener = button;
  button.setAttribute("aria-expanded", "true");
  place();
}

function place() {
  if (!opener) return;
  const name = opener.getBoundingClientRect();
  const { width, height } = box.getBoundingClientRect();
  const below = name.bottom + GAP;
  box.style.left = `${Math.max(GAP, Math.min(name.left, innerWidth - width - GAP))}px`;
  box.style.top = `${below + height < innerHeight ? below : Math.max(GAP, name.top - GAP - height)}px`;
}

// It closes at Escape and at a click elsewhere.
box.addEventListener("toggle", ({ newState }) => {
  if (newState === "open") return;
  opener?.removeAttribute("aria-expanded");
  opener = null;
});
addEventListener("scroll", place, { passive: true });
addEventListener("resize", place);
