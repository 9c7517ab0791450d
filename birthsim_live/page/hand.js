// The hand of this window: what it does is sent to the rig, often enough and not too often. One thing holds at a time.

const LEAST_GAP = 1000 / 120; // ms between messages
const STILL_HERE = 300; // ms; the rig lets go of a hand that it has not heard of for 3 s

export class Hand {
  /** `send(message)` returns whether it went out; `sent(id, time)` is told what did. */
  constructor({ send, sent }) {
    Object.assign(this, { send, sent });
    this.holder = null; // the pointer or the keys: `letGo()` is called when they hold no more
    this.held = null; // offset, m, from the end effector to the place where it is held
    this.pending = null;
    this.lastSent = -Infinity;
    // Windows count from different numbers, so that none takes another's drag for its own.
    this.id = Math.floor(Math.random() * 2 ** 30);
    window.addEventListener("blur", () => this.release());
    window.addEventListener("pagehide", () => this.release());
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
  }

  free(holder) {
    return this.holder === null || this.holder === holder;
  }

  /** `holder` does `action`, a message without its id, since `time`; of several within one gap the last one goes out. */
  act(holder, action, time = performance.now()) {
    this.holder = holder;
    this.action = action;
    const gap = performance.now() - this.lastSent;
    const waiting = this.pending !== null;
    this.pending = { action, time };
    if (gap >= LEAST_GAP) this.flush();
    else if (!waiting) setTimeout(() => this.flush(), LEAST_GAP - gap);
  }

  flush() {
    if (!this.pending) return;
    const { action, time } = this.pending;
    this.pending = null;
    this.lastSent = performance.now();
    this.id += 1;
    if (this.send({ ...action, id: this.id })) this.sent(this.id, time);
  }

  /** Called with every frame: a hand that rests tells the rig now and then that it is still there. */
  stay() {
    if (this.holder && performance.now() - this.lastSent > STILL_HERE) this.act(this.holder, this.action);
  }

  release() {
    const { holder } = this;
    if (!holder) return;
    Object.assign(this, { holder: null, held: null, pending: null });
    holder.letGo();
    this.send({ type: "release" });
  }
}
