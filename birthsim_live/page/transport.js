// Pause, reset, slow motion, recording; of a replay its file, settings and scrubber.

import { inWords } from "./described.js";

const byId = (id) => document.getElementById(id);
const SLOW = 0.85; // of real time
const PATIENCE = 2000; // ms
const SPEEDS = [0.5, 0.2, 0.1]; // that it may then go over to
const SPARE = 0.9; // of what it can

export class Transport {
  /** `address(name)` is where a recording can be saved from, `tell(words)` says what the page does by itself. */
  constructor(send, address, tell) {
    this.tell = tell;
    this.late = null; // ms since when the machine is too slow; Infinity once speed has been seen to
    this.send = send;
    this.address = address;
    this.state = { paused: false, speed: 1, recording: null };
    byId("pause").addEventListener("click", () => this.togglePause());
    byId("reset").addEventListener("click", () => this.reset());
    byId("speed").addEventListener("change", (event) => {
      this.late = Infinity;
      send({ type: "speed", speed: Number(event.target.value) });
    });
    byId("device").addEventListener("click", () => send({ type: "device", on: !this.state.device }));
    byId("record").addEventListener("click", () => send({ type: "record", on: !this.state.recording }));
    this.scrub = byId("scrub");
    this.held = false;
    this.asked = null;
    this.scrub.addEventListener("input", () => this.seek());
    this.scrub.addEventListener("pointerdown", () => (this.held = true));
    for (const type of ["pointerup", "pointercancel", "blur"]) this.scrub.addEventListener(type, () => (this.held = false));
  }

  setUp({ mode }) {
    document.body.dataset.mode = mode;
    this.replay = mode === "replay";
    byId("mode").textContent = mode;
    document.title = `BirthSIM ${mode}`;
    byId("reset").querySelector("span").textContent = this.replay ? "Start" : "Reset";
  }

  togglePause() {
    this.send({ type: "pause", paused: !this.state.paused });
  }

  /** A replay has no state to reset: it goes back to its start. */
  reset() {
    this.send(this.replay ? { type: "seek", time: 0 } : { type: "reset" });
  }

  seek() {
    if (this.asked === null) {
      requestAnimationFrame(() => {
        this.send({ type: "seek", time: this.asked });
        this.asked = null;
      });
    }
    this.asked = this.scrub.valueAsNumber;
    this.writeTime(this.asked);
  }

  show(state) {
    this.state = state;
    const pause = byId("pause");
    pause.classList.toggle("paused", state.paused);
    pause.querySelector("span").textContent = state.paused ? "Run" : "Pause";
    const speed = byId("speed");
    if (![...speed.options].some(({ value }) => Number(value) === state.speed)) {
      speed.add(new Option(`1 : ${Number((1 / state.speed).toPrecision(3))}`, state.speed));
    }
    speed.value = state.speed;
    if (this.replay) {
      this.scrub.max = this.duration = state.duration;
      byId("file").textContent = state.file;
    } else {
      this.showDevice(state);
      this.showRecording(state);
    }
  }

  /** The settings of a replay at its present instant, in words. */
  showSettings(settings) {
    byId("played").textContent = inWords(settings);
  }

  /** Whether a haptic device is the hand, and how much of what it says is ignored. */
  showDevice({ device, device_ignored: ignored }) {
    const button = byId("device");
    button.setAttribute("aria-pressed", String(device));
    const { count = 0, why } = ignored ?? {};
    button.textContent = count ? `Haptic device, ${count} ignored` : "Haptic device";
    button.title = count ? `${count} messages of the device ignored; the last: ${why}` : "A Haply Inverse3 is the hand";
    if (count && !this.ignored) this.tell(`The device says what is ignored: ${why}`);
    this.ignored = count;
  }

  showRecording({ recording, last_recording: last }) {
    const record = byId("record");
    record.setAttribute("aria-pressed", String(Boolean(recording)));
    record.querySelector("span").textContent = recording ? `Stop, ${recording.seconds.toFixed(0)} s` : "Record";
    const download = byId("download");
    download.hidden = Boolean(recording) || !last;
    if (last) {
      download.href = this.address(last);
      download.download = last;
      download.textContent = `save ${last}`;
    }
  }

  /** Called with each frame of the screen: the scrubber moves along unless somebody holds it. */
  step(frame) {
    if (this.replay && !this.held && this.asked === null) {
      this.scrub.value = frame.time;
      this.writeTime(frame.time);
    }
  }

  /** A machine that is too slow for real time goes over to slow motion, once, unless a person has chosen the speed. */
  keepUp({ real_time: share }, now) {
    if (this.replay || this.late === Infinity || share === null) return;
    this.late = share < SLOW && this.state.speed === 1 ? Math.min(this.late ?? now, now) : null;
    if (this.late === null || now < this.late + PATIENCE) return;
    const speed = SPEEDS.find((one) => one <= SPARE * share);
    if (!speed) return;
    this.late = Infinity;
    this.send({ type: "speed", speed });
    this.tell(`This machine is too slow for real time: the rig runs at 1 : ${1 / speed}. The Lab has other speeds.`);
  }

  writeTime(time) {
    const words = `${time.toFixed(1)} / ${this.duration.toFixed(1)} s`;
    const output = byId("scrub-time");
    if (output.textContent === words) return;
    output.textContent = words;
    this.scrub.setAttribute("aria-valuetext", words);
  }
}
