// Real time: simulated time keeps pace with the wall's, and what it cannot is told.

const SLICE = 4; // ms
const FRAME = 1000 / 75; // ms between frames in motion
const IDLE_FRAME = 100; // ms at rest
const MOST_LAG = 0.05; // s that are caught up with
const WINDOW = 1; // s over which the real-time factor is taken

const seconds = () => performance.now() / 1e3;

/** How many control periods are due. */
export class Pace {
  constructor(period) {
    this.period = period;
    this.restart();
  }

  restart() {
    this.behind = 0;
    this.skip();
  }

  /** Let what went by be no lag: the rig stood still. */
  skip() {
    this.last = seconds();
    this.owed = 0;
    this.run = [[this.last, 0]];
  }

  due(now, speed) {
    this.owed += (now - this.last) * speed;
    this.last = now;
    const most = MOST_LAG * speed + this.period;
    if (this.owed > most) {
      this.behind += (this.owed - most) / speed;
      this.owed = most;
    }
    return Math.floor(this.owed / this.period + 1e-6);
  }

  ran(periods) {
    const now = seconds();
    this.owed -= periods * this.period;
    this.run.push([now, this.run.at(-1)[1] + periods * this.period]);
    while (this.run.length > 2 && this.run[1][0] <= now - WINDOW) this.run.shift();
  }

  /** Simulated time over wall time times `speed`; null before a tenth of a second. */
  factor(speed) {
    const [[begun, from], [ended, to]] = [this.run[0], this.run.at(-1)];
    return ended - begun > WINDOW / 10 ? (to - from) / ((ended - begun) * speed) : null;
  }
}

export class Clock {
  /** Runs a session and hands every frame to `onFrame`. */
  constructor(session, frame, onFrame) {
    Object.assign(this, { session, frame, onFrame, paused: false, speed: 1, frames: 0, shown: 0, unshown: true, busy: false });
    this.pace = new Pace(session.period);
  }

  start() {
    this.pace.restart();
    this.slice();
  }

  pause(paused) {
    this.paused = paused;
    if (!paused) this.pace.restart();
  }

  setSpeed(speed) {
    this.speed = speed;
    this.pace.skip();
  }

  /** Something has changed that a frame must show. */
  touch() {
    this.unshown = true;
  }

  slice() {
    const begun = performance.now();
    const running = !(this.paused || this.session.halted);
    if (!running) this.pace.skip();
    else if (this.busy) this.pace.ran(0); // a controller in Python is waited for
    else this.advance(begun);
    const now = performance.now();
    const between = running || this.unshown ? FRAME : IDLE_FRAME;
    if (now >= this.shown + between) {
      this.shown = Math.max(this.shown + between, now - between);
      this.unshown = false;
      this.emit(running);
    }
    setTimeout(() => this.slice(), Math.max(1, begun + SLICE - performance.now()));
  }

  /** Be where the wall's time is, between two slices: a haptic device waits for its force. */
  catchUp() {
    if (!(this.paused || this.session.halted || this.busy)) this.advance(performance.now());
  }

  async advance(begun) {
    this.busy = true;
    const periods = this.pace.due(begun / 1e3, this.speed);
    this.pace.ran(periods ? await this.session.advance(periods, begun + 2 * SLICE) : 0);
    this.busy = false;
  }

  emit(running) {
    this.frames += 1;
    const factor = running ? this.pace.factor(this.speed) : null;
    this.onFrame({ type: "frame", n: this.frames, ...this.frame(this.session), real_time: factor, behind: this.pace.behind });
  }
}
