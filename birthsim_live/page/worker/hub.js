// The page's messages in, news out.

import { Clock } from "./clock.js";
import { Device } from "./device.js";
import { frameOf } from "./frames.js";
import { checkedMessage } from "./messages.js";
import { Recorder } from "./recorder.js";
import { Session } from "./session.js";
import { LEARNING, checked } from "./settings.js";

const MESSAGES = ["drag", "push", "release", "device", "hidden", "learned", "set", "pause", "speed", "reset", "record"];

export class Hub {
  /** `post` sends a message to the page. */
  constructor(pack, bundle, post) {
    Object.assign(this, { pack, post, device: null, hidden: false });
    this.session = new Session(pack, bundle);
    this.clock = new Clock(this.session, frameOf, (frame) => this.onFrame(frame));
    this.told = {};
    this.lastRecording = null;
  }

  start() {
    const { settings, state } = this.news();
    this.post({ type: "hello", mode: "live", ...this.pack.hello, settings: settings.settings, state });
    this.clock.paused = Boolean(this.pack.hello.replay); // nobody sees it
    this.clock.start();
    this.receive({ type: "set", settings: this.pack.opens });
  }

  async receive(message) {
    try {
      const { type } = checkedMessage(message, MESSAGES, this.pack.hello, this.pack.numbers);
      await this[`on_${type}`](message);
      this.clock.touch();
    } catch (error) {
      this.post({ type: "error", message: error.message });
    }
  }

  on_drag(hold) {
    this.session.hands.hold = hold;
    this.heard = performance.now();
  }

  on_push(hold) {
    this.on_drag(hold);
  }

  on_release() {
    this.session.hands.hold = null;
  }

  /** A haptic device is the hand, or is no longer. */
  on_device({ on }) {
    if (!on) this.device?.end();
    else if (this.device) this.device.stay();
    else this.device = new Device(this, (reason) => {
      this.device = null;
      if (reason) this.post({ type: "error", message: reason });
    });
  }

  /** Nobody sees the page, or somebody does again. */
  on_hidden({ hidden }) {
    this.hidden = hidden;
  }

  /** The controller that learns knows more; a rig that it lost begins anew. */
  on_learned({ network }) {
    this.session.teach(network);
    if (this.session.halted && [this.session, this.session.second].some((one) => one?.settings.controller === LEARNING)) this.on_reset();
  }

  on_pause({ paused }) {
    this.clock.pause(paused);
  }

  on_speed({ speed }) {
    this.clock.setSpeed(speed);
  }

  on_set({ settings }) {
    const { time } = this.session;
    this.session.change(checked(settings, this.pack.hello));
    if (this.session.time < time) this.clock.pace.restart(); // what is compared starts anew
  }

  on_reset() {
    this.session.reset();
    this.clock.pace.restart();
  }

  async on_record({ on }) {
    const { session } = this;
    if (on) session.recorder ??= new Recorder(session, nameOf(new Date()));
    else await this.endRecording();
  }

  async endRecording() {
    const { recorder } = this.session;
    if (!recorder) return;
    this.session.recorder = null;
    this.post({ type: "recorded", name: recorder.name, file: await recorder.file() });
    this.lastRecording = recorder.name;
  }

  news() {
    const { session, clock } = this;
    const { recorder } = session;
    if (recorder?.full) this.endRecording().catch(({ message }) => this.post({ type: "error", message }));
    this.device?.watch();
    if (performance.now() - this.heard > 1e3 * this.pack.numbers.patience) this.on_release();
    return {
      settings: { type: "settings", settings: session.shownSettings() },
      state: {
        type: "state",
        paused: clock.paused,
        speed: clock.speed,
        recording: recorder && { file: recorder.name, seconds: Math.floor(recorder.seconds) },
        last_recording: this.lastRecording,
        dragging: session.hands.hold !== null,
        device: Boolean(this.device && !this.device.leaving),
        device_ignored: this.device?.ignored ?? null, // messages that say nothing: how many, and why the last
        duration: session.duration,
      },
      path: { type: "path", points: session.path() },
    };
  }

  onFrame(frame) {
    for (const [kind, message] of Object.entries(this.news())) {
      const words = JSON.stringify(message);
      if (this.told[kind] !== words) this.post(message);
      this.told[kind] = words;
    }
    this.post(frame);
  }
}

/** birthsim-20261123-080910.rec */
function nameOf(now) {
  const two = (number) => String(number).padStart(2, "0");
  const day = `${now.getFullYear()}${two(now.getMonth() + 1)}${two(now.getDate())}`;
  return `birthsim-${day}-${two(now.getHours())}${two(now.getMinutes())}${two(now.getSeconds())}.rec`;
}
