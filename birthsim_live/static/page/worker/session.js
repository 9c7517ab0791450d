// A rig that a person plays with, and one beside it to compare (birthsim_live/rig/session.py): control periods, no clock.

import { Law } from "./law.js";
import { doublesOf } from "./machine.js";
import { Course, Hands, Setpoints } from "./parts.js";
import { NOTHING, merged } from "./settings.js";

export class Session {
  /** `policy` as of `lawOf`. */
  constructor(pack, machine, settings = pack.settings, policy = null) {
    this.pack = pack;
    this.machine = machine;
    this.numbers = pack.numbers;
    this.rows = pack.rows;
    this.period = pack.period;
    this.settings = { ...settings };
    this.lost = null;
    this.paths = 0;
    this.recorder = null;
    this.second = null; // the rig beside it: the same world, settings and hand under the controller `settings.compare`
    this.low = doublesOf(pack.range.low);
    this.high = doublesOf(pack.range.high);
    this.column = doublesOf(pack.rig.column);
    this.world = machine.rows(this.rows.WORLD);
    this.seen = machine.rows(this.rows.SEEN);
    const { plant, begin, show, valves } = pack.stages;
    this.plant = machine.stage(plant);
    this.beginning = machine.stage(begin);
    this.show = machine.stage(show);
    this.valves = Object.fromEntries(Object.entries(valves).map(([name, stage]) => [name, machine.stage(stage)]));
    this.scenarios = {};
    this.models = {};
    this.laws = {};
    this.law = this.lawOf(this.settings.controller, policy);
    const { trajectory, force, schedule, duration } = this.scenario(this.settings.scenario);
    this.duration = duration;
    this.course = new Course(this, trajectory);
    this.setpoints = new Setpoints(this, schedule);
    this.hands = new Hands(this, force, this.settings.scenario_force, this.settings.drag_stiffness);
    this.episode = 0;
    this.exchange(this.settings.sensors);
    this.reset();
  }

  /** s since the last reset. */
  get time() {
    return this.seen.get(this.rows.TIME);
  }

  /** s since the scenario's present episode began. */
  get episodeTime() {
    return this.time - this.course.begins;
  }

  /** The stages of a scenario, made once. */
  scenario(name) {
    const { trajectory, force, schedule, ...rest } = this.pack.scenarios[name];
    this.scenarios[name] ??= {
      ...rest,
      trajectory: this.machine.stage(trajectory),
      force: this.machine.stage(force),
      schedule: this.machine.stage(schedule),
    };
    return this.scenarios[name];
  }

  /** A controller, made once, fresh; `policy` is the stage of its policy, where it has one. */
  lawOf(name, policy) {
    this.laws[name] ??= new Law(this, this.pack.controllers[name], policy);
    this.laws[name].reset();
    return this.laws[name];
  }

  /** Measure with another sensor model from the next instant on. */
  exchange(name) {
    const { sampled, stages } = this.pack.sensors[name];
    this.models[name] ??= stages.map((stage) => this.machine.stage(stage));
    this.model = { name, sampled, stages: this.models[name] };
    this.beginSensors();
  }

  beginSensors() {
    const { begun } = this.pack.sensors[this.model.name];
    begun[this.episode % begun.length].forEach((tables, k) => {
      for (const [table, bytes] of Object.entries(tables)) this.model.stages[k].fill(Number(table), bytes);
    });
    this.first = null;
  }

  /** Run a stage of the sensors on their own clock, which starts where they first measure. */
  onTheirClock(stage) {
    const { rows, world, seen } = this;
    const [tick, time] = [world.get(rows.TICK), seen.get(rows.TIME)];
    if (this.first > 0) {
      world.set(rows.TICK, tick - this.first);
      seen.set(rows.TIME, (tick - this.first) * this.period);
    }
    stage.run(seen, world);
    world.set(rows.TICK, tick);
    seen.set(rows.TIME, time);
  }

  measure() {
    const { rows, seen } = this;
    this.first ??= this.world.get(rows.TICK);
    this.onTheirClock(this.model.stages[0]);
    if (this.first > 0) seen.set(rows.POSITION_TIME, seen.get(rows.POSITION_TIME) + this.first * this.period);
    this.sampled = this.model.sampled;
  }

  look() {
    this.course.run();
    this.setpoints.run();
    this.hands.run();
    this.measure();
  }

  /** Start the scenario anew: pistons on the target, in balance, at time zero. The settings stay. */
  reset() {
    const { rows, world, seen } = this;
    this.describeRig();
    this.episode = 0;
    this.lost = null;
    world.set(rows.TICK, 0);
    seen.set(rows.TIME, 0);
    this.setpoints.choose(chosen(this.settings));
    for (const part of [this.course, this.setpoints, this.hands]) part.restart();
    this.beginSensors();
    seen.fill(rows.OPENING, [0, 0, 0, 0]);
    world.fill(rows.IMPACT, [0, 0]);
    this.plant.restart();
    this.course.run();
    this.setpoints.run();
    this.beginning.run(seen, world);
    this.look();
    this.law.reset();
    this.paths += 1;
    if (!this.second) return;
    this.second.hands.hold = this.hands.hold;
    this.second.reset();
  }

  /** Write the rig that moves: mass and friction as set. */
  describeRig() {
    const { rows, coulomb, viscous, static_ratio: ratio } = this.pack.rig;
    const { mass, friction } = this.settings;
    this.world.fill(0, this.column);
    this.world.set(rows.mass, mass);
    this.world.set(rows.inverse_mass, 1 / mass);
    coulomb.forEach((force, k) => {
      this.world.set(rows[`fc${k + 1}`], force * friction);
      this.world.set(rows[`fs${k + 1}`], ratio * (force * friction));
      this.world.set(rows[`fv${k + 1}`], viscous[k] * friction);
    });
  }

  /**
   * Apply checked settings; the rig keeps its state and its motion, unless another pair of controllers is to be compared.
   * `policy` and `compared`, that of the second rig, as of `lawOf`.
   */
  change(changes, policy, compared) {
    const before = this.settings;
    const after = merged(before, changes, this.scenarioSetpoints());
    if (after.controller !== before.controller) this.law = this.lawOf(after.controller, policy);
    this.settings = after;
    this.describeRig();
    if (after.scenario !== before.scenario) {
      this.duration = this.scenario(after.scenario).duration;
      this.episode = 0;
      this.follow();
    }
    const [now, then] = [chosen(after), chosen(before)];
    if (JSON.stringify(now) !== JSON.stringify(then)) this.setpoints.choose(now);
    if (after.sensors !== before.sensors) this.exchange(after.sensors);
    if (after.scenario_force !== before.scenario_force) this.hands.want(after.scenario_force);
    this.hands.stiffness = after.drag_stiffness;
    this.compare(before, changes, compared);
  }

  /** Let the second rig follow the settings, come or go. */
  compare(before, { controller, compare, ...others }, policy) {
    const now = this.settings;
    if (now.compare === NOTHING) this.second = null;
    else if (this.second && now.compare === before.compare) this.second.change(others);
    else {
      const own = { ...now, controller: now.compare, compare: NOTHING };
      this.second = new Session(this.pack, this.machine.another(), own, policy);
    }
    if (this.second && (now.controller !== before.controller || now.compare !== before.compare)) this.reset();
  }

  /** Go over to the start of an episode of the scenario. */
  follow() {
    const { trajectory, force, schedule } = this.scenario(this.settings.scenario);
    this.course.follow(trajectory);
    this.hands.follow(force);
    this.setpoints.follow(schedule);
    this.paths += 1;
  }

  /** Run up to `periods` control periods, none begun after `until` (ms of performance.now), at least one; how many. */
  advance(periods, until) {
    let done = 0;
    while (done < periods && !this.halted && (done === 0 || performance.now() < until)) {
      this.advanceOne();
      if (this.second && this.lost === null) {
        this.second.hands.hold = this.hands.hold;
        this.second.advanceOne();
      }
      done += 1;
      this.recorder?.take(this);
    }
    return done;
  }

  advanceOne() {
    const { rows, seen, world } = this;
    const openings = this.law.openings(seen, this.sampled, this.settings.damping);
    if (openings === null) {
      this.lost = `${this.settings.controller} gives up: it has no gains for these setpoints.`;
      return;
    }
    const valves = this.settings.valves;
    const action = valves === "two_valves" ? openings : [(openings[0] - openings[1]) / 2, (openings[2] - openings[3]) / 2];
    seen.fill(rows.ACTION, action);
    world.fill(rows.IMPACT, [0, 0]);
    this.valves[valves].run(seen);
    if (this.model.stages.length > 1 && this.first !== null) this.onTheirClock(this.model.stages[1]);
    this.plant.run(seen, world);
    this.look();
    this.lost = this.leftRange();
    if (this.lost === null && this.episodeTime > this.duration - this.period / 2) {
      this.episode += 1;
      this.follow();
    }
  }

  leftRange() {
    const state = this.world.some(this.rows.STATE, this.low.length);
    const row = state.findIndex((value, k) => !(value > this.low[k] && value < this.high[k]));
    if (row < 0) return null;
    if (!state.every(Number.isFinite)) return "the state is no longer finite";
    const [kind, unit] = this.pack.range.names[row].startsWith("P") ? ["pressure", "Pa"] : ["temperature", "K"];
    const chamber = this.pack.range.names[row].slice(1).toUpperCase();
    const words = [state[row], this.low[row], this.high[row]].map((value) => Number(value.toPrecision(6)));
    return `${kind} of chamber ${chamber} = ${words[0]} ${unit}; the model holds from ${words[1]} to ${words[2]}`;
  }

  /** Both rigs stand still where one is lost. */
  get halted() {
    return this.lost !== null || Boolean(this.second?.lost);
  }

  /** What the scenario asks for at this time. */
  scenarioSetpoints() {
    const asked = this.setpoints.scenario();
    return Object.fromEntries(this.pack.stiffnesses.map((name, k) => [name, Math.round(1e3 * asked[k]) / 1e3]));
  }

  /** The settings as the page shows them: with the scenario's setpoints where they hold. */
  shownSettings() {
    const given = this.settings.stiffness_source === "scenario" ? this.scenarioSetpoints() : {};
    return { ...this.settings, ...given, damping_applies: this.law.damped || Boolean(this.second?.law.damped) };
  }

  path() {
    return this.pack.scenarios[this.settings.scenario].path;
  }
}

function chosen({ stiffness_source: source, Kclx, Kcly, Kpneu1, Kpneu2 }) {
  return source === "sliders" ? [Kclx, Kcly, Kpneu1, Kpneu2] : null;
}
