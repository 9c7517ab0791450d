// Measures the page itself: frames drawn per second and the time from pointer to motion.

const KEPT = 4096;

export class Monitor {
  constructor() {
    this.first = null; // ms from the address to the first frame that is drawn
    this.restart();
  }

  /** Forget all that was measured. */
  restart() {
    this.begun = performance.now();
    this.drawn = 0;
    this.received = 0;
    this.latencies = [];
    this.waiting = []; // drag messages the physics has not answered yet, oldest first
  }

  sent(id, time) {
    this.waiting.push({ id, time });
    if (this.waiting.length > KEPT) this.waiting.shift();
  }

  /** A frame is on the canvas: every drag message that it includes has now become motion. */
  drew(frame) {
    this.drawn += 1;
    this.first ??= performance.now();
    const index = this.waiting.findIndex(({ id }) => id === frame.pointer_id);
    if (index < 0) return;
    const now = performance.now();
    for (const { time } of this.waiting.splice(0, index + 1)) this.latencies.push(now - time);
    if (this.latencies.length > KEPT) this.latencies.splice(0, this.latencies.length - KEPT);
  }

  /** `seconds`, `drawn` and `received` frames since the last restart, and `latencies` in ms. */
  report() {
    const { drawn, received, latencies } = this;
    return { seconds: (performance.now() - this.begun) / 1e3, drawn, received, latencies: [...latencies] };
  }
}
