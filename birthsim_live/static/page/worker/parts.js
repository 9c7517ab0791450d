// What is asked for and who pushes (birthsim_live/rig: bridge, setpoints, hand): a scenario's stages, and what a person sets.

import { Bridge, Fade } from "./passages.js";

/** Runs `stage` as if `begins` had been the start of time; the rows of `seen` keep their time. */
function sample(stage, seen, world, rows, begins) {
  const time = seen.get(rows.TIME);
  seen.set(rows.TIME, time - begins);
  stage.run(seen, world);
  seen.set(rows.TIME, time);
}

/** The target: a scenario's trajectory since `begins`, reached over a bridge from what was before. */
export class Course {
  constructor(rig, trajectory) {
    this.rig = rig;
    this.trajectory = trajectory;
    this.restart();
  }

  restart() {
    this.begins = 0;
    this.bridge = null;
  }

  /** Write the target of this instant, 8 rows. */
  run() {
    const { seen, world, rows } = this.rig;
    sample(this.trajectory, seen, world, rows, this.begins);
    if (!this.bridge) return;
    const offset = this.bridge.sample(seen.get(rows.TIME));
    offset.forEach((value, k) => seen.set(rows.REFERENCE + k, seen.get(rows.REFERENCE + k) + value));
  }

  /** From now on follow another trajectory, or the same one anew. */
  follow(trajectory) {
    const { seen, rows, numbers } = this.rig;
    const now = seen.get(rows.TIME);
    const target = () => {
      this.run();
      return seen.some(rows.REFERENCE, 8);
    };
    const before = target();
    Object.assign(this, { trajectory, begins: now, bridge: null });
    const offset = target().map((value, k) => before[k] - value);
    if (Math.max(...offset.map(Math.abs)) > numbers.negligible) {
      const lasts = numbers.least_time + Math.sqrt(offset[0] * offset[0] + offset[1] * offset[1]) / numbers.pace;
      this.bridge = new Bridge(now, lasts, offset);
    }
    seen.fill(rows.REFERENCE, before);
  }
}

const COUNT = 7; // rows of setpoints: Kclx, Kcly, Kpneu1, Kpneu2, rates of those two, Kclxy
const VALUES = [0, 1, 2, 3, 6];
const RATES = [4, 5];

/** Stiffness setpoints: a scenario's since `begins`, or chosen ones; every change passes over smoothly. */
export class Setpoints {
  constructor(rig, schedule) {
    this.rig = rig;
    this.schedule = schedule;
    this.chosen = null;
    this.restart();
  }

  restart() {
    this.begins = 0;
    this.fade = null;
  }

  /** Write the setpoints of this instant. */
  run() {
    const { seen, world, rows } = this.rig;
    const first = rows.REFERENCE + 8;
    if (this.chosen) seen.fill(first, [...this.chosen, 0, 0, 0]);
    else sample(this.schedule, seen, world, rows, this.begins);
    const now = seen.get(rows.TIME);
    if (!this.fade || this.fade.over(now)) return;
    const [offset, rate] = this.fade.sample(now);
    VALUES.forEach((row, k) => seen.set(first + row, seen.get(first + row) + offset[k]));
    RATES.forEach((row, k) => seen.set(first + row, seen.get(first + row) + rate[2 + k]));
  }

  follow(schedule) {
    this.change(() => Object.assign(this, { schedule, begins: this.rig.time }));
  }

  /** Ask for Kclx, Kcly, Kpneu1, Kpneu2; null gives them back to the schedule. */
  choose(values) {
    this.change(() => (this.chosen = values));
  }

  /** What the schedule itself asks for now. */
  scenario() {
    return this.kept(() => {
      const { seen, world, rows } = this.rig;
      sample(this.schedule, seen, world, rows, this.begins);
      return seen.some(rows.REFERENCE + 8, COUNT);
    });
  }

  change(act) {
    const values = () =>
      this.kept(() => {
        this.run();
        const all = this.rig.seen.some(this.rig.rows.REFERENCE + 8, COUNT);
        return VALUES.map((row) => all[row]);
      });
    const before = values();
    act();
    this.fade = null;
    const after = values();
    const offset = before.map((value, k) => value - after[k]);
    if (offset.some((value) => value !== 0)) this.fade = new Fade(this.rig.time, this.rig.numbers.setpoint_transition, offset);
  }

  /** What `look` returns; the rows that it writes stay as they were. */
  kept(look) {
    const { seen, rows } = this.rig;
    const before = seen.some(rows.REFERENCE + 8, COUNT);
    const found = look();
    seen.fill(rows.REFERENCE + 8, before);
    return found;
  }
}

/** A force that is shortened to `most` where it is larger. */
function limited([x, y], most) {
  const size = Math.sqrt(x * x + y * y);
  return size > most ? [x * (most / size), y * (most / size)] : [x, y];
}

/** The scenario's force, where it is wanted, and the person's: a spring from the end effector to the pointer. */
export class Hands {
  constructor(rig, force, wanted, stiffness) {
    Object.assign(this, { rig, source: force, wanted, stiffness });
    this.hold = null; // { position, id } of a hand at a place, { force, id } of one that pushes
    this.used = null;
    this.scenarioNow = [0, 0];
    this.dragNow = [0, 0];
    this.restart();
  }

  restart() {
    this.begins = 0;
    this.fade = null;
  }

  /** Write the force of this instant. */
  run() {
    const { world, rows } = this.rig;
    const now = this.rig.time;
    let forces = this.scenarioAt();
    if (this.fade && !this.fade.over(now)) {
      const [offset] = this.fade.sample(now);
      forces = forces.map((value, k) => value + offset[k]);
    }
    this.scenarioNow = forces;
    this.dragNow = [0, 0];
    if (this.hold) {
      this.dragNow = limited(this.hold.force ?? this.pull(this.hold.position), this.rig.numbers.drag_limit);
      this.used = this.hold.id;
      forces = forces.map((value, k) => value + this.dragNow[k]);
    }
    world.fill(rows.FORCE, forces);
  }

  pull(pointer) {
    const { world, rows, numbers } = this.rig;
    const motion = world.some(rows.MOTION, 4);
    return [0, 1].map((k) => this.stiffness * (pointer[k] - motion[k]) - numbers.drag_damping * motion[2 + k]);
  }

  /** Where the spring from the end effector ends, or would end for a hand that pushes; null where there is no hand. */
  get pointer() {
    if (!this.hold?.force) return this.hold?.position ?? null;
    const position = this.rig.world.some(this.rig.rows.MOTION, 2);
    return position.map((value, k) => value + this.hold.force[k] / this.stiffness);
  }

  follow(force) {
    Object.assign(this, { source: force, begins: this.rig.time });
    this.passOver();
  }

  want(wanted) {
    this.wanted = wanted;
    this.passOver();
  }

  scenarioAt() {
    const { seen, world, rows } = this.rig;
    if (!this.wanted) return [0, 0];
    const before = world.some(rows.FORCE, 2);
    sample(this.source, seen, world, rows, this.begins);
    const forces = world.some(rows.FORCE, 2);
    world.fill(rows.FORCE, before);
    return forces;
  }

  passOver() {
    const now = this.scenarioAt();
    const offset = this.scenarioNow.map((value, k) => value - now[k]);
    this.fade = new Fade(this.rig.time, this.rig.numbers.hand_transition, offset);
  }
}
