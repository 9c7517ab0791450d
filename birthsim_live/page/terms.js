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
  const place = button.getBoundingClientRect();
  const { width, height } = box.getBoundingClientRect();
  const below = place.bottom + GAP;
  box.style.left = `${Math.max(GAP, Math.min(place.left, innerWidth - width - GAP))}px`;
  box.style.top = `${below + height < innerHeight ? below : Math.max(GAP, place.top - GAP - height)}px`;
}

// It closes at Escape, at a click elsewhere, and when the page scrolls away from under it.
box.addEventListener("toggle", ({ newState }) => {
  if (newState === "open") return;
  opener?.removeAttribute("aria-expanded");
  opener = null;
});
addEventListener("scroll", () => opener && box.hidePopover(), { passive: true });
