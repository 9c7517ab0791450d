// Keys of the page: arrows push the heads, space pauses, R resets.

const PUSH = 20; // N of an arrow key
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

export class Keys {
  /** `enabled()` says whether there is a rig to push. */
  constructor(hand, enabled) {
    this.hand = hand;
    this.enabled = enabled;
    this.pressed = new Set();
    window.addEventListener("keydown", (event) => this.press(event));
    window.addEventListener("keyup", (event) => this.lift(event));
  }

  press(event) {
    if (!ARROWS[event.key] || !this.enabled() || belongsToAnother(event)) return;
    event.preventDefault();
    if (!this.hand.free(this) || this.pressed.has(event.key)) return;
    this.pressed.add(event.key);
    this.push();
  }

  lift(event) {
    if (!this.pressed.delete(event.key)) return;
    if (this.pressed.size) this.push();
    else this.hand.release();
  }

  letGo() {
    this.pressed.clear();
  }

  /** Every head feels the same force, wherever it is. */
  push() {
    let [dx, dy] = [0, 0];
    for (const key of this.pressed) {
      dx += ARROWS[key][0];
      dy += ARROWS[key][1];
    }
    const length = Math.hypot(dx, dy) || 1;
    this.hand.act(this, { type: "push", force: [(PUSH * dx) / length, (PUSH * dy) / length] });
  }
}

const modified = (event) => event.altKey || event.ctrlKey || event.metaKey;

/** Sliders and lists keep their arrow keys. */
const belongsToAnother = (event) => modified(event) || event.target.closest?.("input, select") != null;

/** Space presses a focused button or box and opens a focused list; R would choose from a list by its first letter. */
export function keyOfTheRig(event) {
  if (event.repeat || modified(event)) return null;
  if (event.key === " ") return event.target.closest?.("button, select, a, [type=checkbox], [type=radio]") ? null : "pause";
  return event.key.toLowerCase() === "r" ? "reset" : null;
}
