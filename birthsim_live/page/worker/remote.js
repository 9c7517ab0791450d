// A controller that runs in Python (birthsim_live/server/controller.py): in each control period it is sent what is measured and
// asked for, and answers with openings. The rig waits for it.

import { shown } from "../refusal.js";

const OPENINGS = 4;

/** What Python has answered: four openings, or why there are none. */
function answerIn(data) {
  if (typeof data === "string") return { fault: data };
  const openings = data.byteLength === OPENINGS * Float64Array.BYTES_PER_ELEMENT ? new Float64Array(data) : [];
  const fits = openings.length === OPENINGS && openings.every((one) => Math.abs(one) <= 1);
  return fits ? { openings } : { fault: `Python answers ${shown(Array.from(openings))}, ${data.byteLength} bytes; allowed: ${OPENINGS} openings from -1 to 1` };
}

export class Remote {
  /** `name` is that of a choice. A controller is made with each of these, and forgotten when it is closed. */
  constructor(name) {
    const place = new URL(`../controller?name=${encodeURIComponent(name)}`, import.meta.url);
    place.protocol = place.protocol.replace("http", "ws");
    this.openings = null;
    this.fault = null; // why it gives none
    this.socket = new WebSocket(place);
    this.socket.binaryType = "arraybuffer";
    this.made = new Promise((made) => ["open", "close"].forEach((kind) => this.socket.addEventListener(kind, made)));
    this.socket.addEventListener("message", ({ data }) => this.settle(answerIn(data)));
    this.socket.addEventListener("close", () => this.settle({ fault: "Python has gone." }));
  }

  get answered() {
    return Boolean(this.fault ?? this.openings);
  }

  /** Wait for an answer to what a session measures now; without one where this is closed meanwhile. */
  async ask({ loop, sampled, pack }) {
    await this.made;
    if (this.fault) return;
    const [first, count] = pack.signals;
    await new Promise((answer) => {
      this.answer = answer;
      this.socket.send(Float64Array.of(Number(sampled), ...loop.rows.subarray(first, first + count)));
    });
  }

  settle(said) {
    if (!this.fault) Object.assign(this, said);
    this.answer?.();
  }

  /** Open the valves as it has answered; why not, where it gives up. */
  act(session) {
    if (!this.fault) session.fill("opening_P1", this.openings);
    this.openings = null;
    return this.fault;
  }

  close() {
    this.settle({ fault: "It is closed." });
    this.socket.close();
  }
}
