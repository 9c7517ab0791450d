// A canvas that keeps as many pixels as the screen shows, whatever its size and the device's pixel ratio.

import { PAPER } from "./pen.js";

const ratioNow = () => Math.min(window.devicePixelRatio || 1, 3);

export class Sheet {
  /**
   * `changed` is called with width and height (CSS px) whenever the room changes. An `opaque` canvas is painted all over in
   * every frame, which spares the browser from blending it.
   */
  constructor(canvas, { changed, opaque = false } = {}) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: !opaque });
    this.changed = changed;
    this.opaque = opaque;
    this.width = 0;
    this.height = 0;
    this.ratio = 0;
    new ResizeObserver(() => this.fit()).observe(canvas);
    this.fit();
  }

  /** Call before each frame: a window may have moved to a screen with another pixel ratio. */
  check() {
    if (ratioNow() !== this.ratio) this.fit();
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = ratioNow();
    if (width === this.width && height === this.height && ratio === this.ratio) return;
    Object.assign(this, { width, height, ratio });
    this.canvas.width = Math.max(1, Math.round(width * ratio));
    this.canvas.height = Math.max(1, Math.round(height * ratio));
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (this.opaque) this.cover(); // black until the first frame otherwise
    this.changed?.(width, height);
  }

  cover() {
    this.context.fillStyle = PAPER;
    this.context.fillRect(0, 0, this.width, this.height);
  }

  /** A canvas of the same size for what rarely changes; returns its context in CSS px. */
  backdrop() {
    const copy = document.createElement("canvas");
    copy.width = this.canvas.width;
    copy.height = this.canvas.height;
    const context = copy.getContext("2d");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    return context;
  }

  /** Cover everything with a backdrop. */
  lay(backdrop) {
    this.context.drawImage(backdrop.canvas, 0, 0, this.width, this.height);
  }
}
