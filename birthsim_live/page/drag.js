// The hand: mouse, pen, finger and arrow keys hold the end effector through the server's spring.

const LEAST_GAP = 1000 / 120; // ms between messages
const STILL_HERE = 300; // ms; the rig lets go of a hand that it has not heard of for 3 s
const PUSH = 20; // N of an arrow key
// Raw updates come when the mouse moves, other moves only when the screen is due: that costs up to a frame.
const MOVE = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

export class Drag {
  /** `rig`: { scene, frame(), stiffness(), enabled(), send(message), sent(id, time) }. */
  constructor(canvas, rig) {
    this.canvas = canvas;
    this.rig = rig;
    this.held = null; // offset, m, from the end effector to the place where it is held
    this.pointer = null;
    this.keys = new Set();
    this.pending = null;
    this.lastSent = -Infinity;
    // Windows count from different numbers, so that none takes another's drag for its own.
    this.id = Math.floor(Math.random() * 2 ** 30);
    this.listen();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    canvas.addEventListener(MOVE, (event) => event.pointerId === this.pointer && this.move(event));
    canvas.addEventListener("pointermove", (event) => event.pointerId !== this.pointer && this.hover(event));
    for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
      canvas.addEventListener(type, (event) => event.pointerId === this.pointer && this.release());
    }
    // A finger on the head drags it; a finger beside it scrolls the page.
    canvas.addEventListener("touchstart", (event) => this.touches(event) && event.preventDefault(), { passive: false });
    window.addEventListener("blur", () => this.release());
    window.addEventListener("pagehide", () => this.release());
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
    window.addEventListener("keydown", (event) => this.press(event));
    window.addEventListener("keyup", (event) => this.lift(event));
  }

  get active() {
    return this.pointer !== null || this.keys.size > 0;
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return this.rig.scene.pen.metres([event.clientX - box.left, event.clientY - box.top]);
  }

  /** Offset of a pointer from the end effector if it is near enough to hold it, else null. */
  reach(event, coarse) {
    const frame = this.rig.frame();
    if (!frame || !this.rig.scene.pen) return null;
    const [x, y] = this.place(event);
    const offset = [x - frame.position[0], y - frame.position[1]];
    return Math.hypot(...offset) * this.rig.scene.pen.scale <= this.rig.scene.grip(coarse) ? offset : null;
  }

  touches(event) {
    return this.reach(event.changedTouches[0], true) !== null;
  }

  grab(event) {
    if (event.button !== 0 || this.pointer !== null || !this.rig.enabled()) return;
    const offset = this.reach(event, event.pointerType !== "mouse");
    if (!offset) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.classList.add("dragging");
    this.pointer = event.pointerId;
    this.held = offset;
    this.move(event);
  }

  hover(event) {
    const near = event.pointerType === "mouse" && this.rig.enabled() && this.reach(event, false) !== null;
    this.canvas.classList.toggle("near", near);
  }

  move(event) {
    const [x, y] = this.place(event);
    this.aim([x - this.held[0], y - this.held[1]], event.timeStamp);
  }

  /** Ask for a position of the spring's far end; of several within one gap the last one goes out. */
  aim(position, time) {
    this.aimed = position;
    const gap = performance.now() - this.lastSent;
    const waiting = this.pending !== null;
    this.pending = { position, time };
    if (gap >= LEAST_GAP) this.flush();
    else if (!waiting) setTimeout(() => this.flush(), LEAST_GAP - gap);
  }

  flush() {
    if (!this.pending) return;
    const { position, time } = this.pending;
    this.pending = null;
    this.lastSent = performance.now();
    this.id += 1;
    if (this.rig.send({ type: "drag", position, id: this.id })) this.rig.sent(this.id, time);
  }

  release() {
    if (!this.active) return;
    this.pointer = null;
    this.held = null;
    this.pending = null;
    this.keys.clear();
    this.canvas.classList.remove("dragging");
    this.rig.send({ type: "release" });
  }

  press(event) {
    const direction = ARROWS[event.key];
    if (!direction || !this.rig.enabled() || belongsToAnother(event)) return;
    event.preventDefault();
    if (this.pointer === null) this.keys.add(event.key);
  }

  lift(event) {
    if (this.keys.has(event.key) && this.keys.size === 1) this.release();
    this.keys.delete(event.key);
  }

  /**
   * Called with every frame: arrow keys push with a constant force, so the spring's far end moves along. A pointer that rests
   * tells the rig now and then that it is still there.
   */
  follow(frame) {
    if (this.pointer !== null && performance.now() - this.lastSent > STILL_HERE) this.aim(this.aimed, performance.now());
    if (this.keys.size === 0) return;
    let [dx, dy] = [0, 0];
    for (const key of this.keys) {
      dx += ARROWS[key][0];
      dy += ARROWS[key][1];
    }
    const reach = PUSH / this.rig.stiffness() / (Math.hypot(dx, dy) || 1);
    this.aim([frame.position[0] + reach * dx, frame.position[1] + reach * dy], performance.now());
  }
}

const modified = (event) => event.altKey || event.ctrlKey || event.metaKey;

/** Sliders and lists keep their arrow keys. */
const belongsToAnother = (event) => modified(event) || event.target.closest?.("input, select") != null;

/** Space presses a focused button or box and opens a focused list; R would choose from a list by its first letter. */
export function keyOfTheRig(event) {
  if (event.repeat || modified(event)) return null;
  if (event.key === " ") return event.target.closest?.("button, select, a, [type=checkbox]") ? null : "pause";
  return event.key.toLowerCase() === "r" ? "reset" : null;
}
