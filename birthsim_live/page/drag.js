// Mouse, pen and finger take hold of an end effector.

// Raw updates come when the mouse moves, other moves only when the screen is due: that costs up to a frame.
const MOVE = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";

export class Drag {
  /** `rig`: { scene, hand, frame(), enabled() }. */
  constructor(canvas, rig) {
    this.canvas = canvas;
    this.rig = rig;
    this.pointer = null;
    this.listen();
  }

  listen() {
    const { canvas, rig } = this;
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    canvas.addEventListener(MOVE, (event) => event.pointerId === this.pointer && this.move(event));
    canvas.addEventListener("pointermove", (event) => event.pointerId !== this.pointer && this.hover(event));
    for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
      canvas.addEventListener(type, (event) => event.pointerId === this.pointer && rig.hand.release());
    }
    // A finger on the head drags it; a finger beside it scrolls the page.
    canvas.addEventListener("touchstart", (event) => this.touches(event) && event.preventDefault(), { passive: false });
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
    const { hand, enabled } = this.rig;
    if (event.button !== 0 || !hand.free() || !enabled()) return;
    const offset = this.reach(event, event.pointerType !== "mouse");
    if (!offset) {
      this.rig.scene.cue = true; // who has missed the head is shown it
      return;
    }
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.classList.add("dragging");
    this.pointer = event.pointerId;
    hand.held = offset;
    this.move(event);
  }

  hover(event) {
    const near = event.pointerType === "mouse" && this.rig.enabled() && this.reach(event, false) !== null;
    this.canvas.classList.toggle("near", near);
  }

  /** The spring's far end: where the end effector would be if it followed the pointer. */
  move(event) {
    const [x, y] = this.place(event);
    const { hand } = this.rig;
    hand.act(this, { type: "drag", position: [x - hand.held[0], y - hand.held[1]] }, event.timeStamp);
  }

  letGo() {
    this.pointer = null;
    this.canvas.classList.remove("dragging");
  }
}
