// The error as a rattle, and on phones as vibration, once somebody asks for it.

const LOUDEST = 0.12; // m/s of the head against its target
const LOW = 90; // Hz
const BUZZ = 60; // ms
const LEAST_BUZZ = 0.03; // m/s

export class Sound {
  constructor(button) {
    this.context = null;
    this.last = null;
    this.buzzed = 0;
    button.addEventListener("click", () => {
      const on = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(on));
      if (on) this.start();
      else this.stop();
    });
  }

  start() {
    this.context = new AudioContext();
    this.tone = this.context.createOscillator();
    this.tone.type = "sawtooth";
    this.tone.frequency.value = LOW;
    this.gain = this.context.createGain();
    this.gain.gain.value = 0;
    this.tone.connect(this.gain).connect(this.context.destination);
    this.tone.start();
  }

  stop() {
    this.context.close();
    this.context = null;
  }

  /** `frame` is of the rig that is chosen; the rattle is as loud as the error changes quickly. */
  push({ time, error_mm: error }, now = performance.now()) {
    const { last } = this;
    this.last = { time, error };
    if (!this.context || !last || !(time > last.time) || !Number.isFinite(error)) return;
    const speed = (1e-3 * Math.abs(error - last.error)) / (time - last.time);
    this.gain.gain.setTargetAtTime(0.3 * Math.min(1, speed / LOUDEST), this.context.currentTime, 0.03);
    if (speed > LEAST_BUZZ && now > this.buzzed + 2 * BUZZ) {
      this.buzzed = now;
      navigator.vibrate?.(BUZZ);
    }
  }
}
