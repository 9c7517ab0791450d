// A rig that a person plays with, and one beside it to compare (birthsim_live/rig/session.py): control periods, no clock.

import { Law } from "./law.js";
import { doublesOf } from "./machine.js";
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
    const first = doublesOf(pack.inputs);
    this.inputs = machine.inputs = machine.rows(first.length);
    this.inputs.fill(0, first);
    const { valves, ...stages } = pack.stages;
    for (const [name, stage] of Object.entries(stages)) this[name] = machine.stage(stage); // plant, begin, show, enter, outside
    this.valves = Object.fromEntries(Object.entries(valves).map(([name, own]) => [name, own.map((stage) => machine.stage(stage))]));
    this.scenarios = {};
    this.models = {};
    this.laws = {};
    this.law = this.lawOf(this.settings.controller, policy);
    this.duration = this.scenario(this.settings.scenario).duration;
    this.hands = new Hands();
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
    return this.time - this.inputs.get(this.rows.inputs.begins);
  }

  /** The stages of a scenario, made once. */
  scenario(name) {
    const { target, force, setpoints, duration } = this.pack.scenarios[name];
    this.scenarios[name] ??= { duration, parts: [target, setpoints, force].map((stage) => this.machine.stage(stage)) };
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
    this.inputs.set(this.rows.inputs.sensors_begin, this.world.get(this.rows.TICK) + 1);
  }

  run(stages) {
    for (const stage of stages) stage.run(this.seen, this.world);
  }

  /** What is asked for, and who pushes, at this instant. */
  look() {
    this.run([this.enter, ...this.scenario(this.settings.scenario).parts, this.outside]);
  }

  measure() {
    this.run(this.model.stages.slice(0, 3));
    this.sampled = this.model.sampled;
  }

  /** Let what has been changed (of `pack.passes`) pass over smoothly from this instant on. */
  passOver(...what) {
    this.inputs.fill(this.rows.inputs.passes, this.pack.passes.map((name) => Number(what.includes(name))));
    this.look();
  }

  /** Ask for setpoints that are chosen, or for the scenario's. */
  choose(values) {
    const { keep, add } = this.rows.inputs;
    const count = this.rows.ASKED - this.rows.REFERENCE;
    this.inputs.fill(keep + 8, new Array(count - 8).fill(values ? 0 : 1));
    this.inputs.fill(add + 8, values ?? [0, 0, 0, 0]);
  }

  /** Start the scenario anew: pistons on the target, in balance, at time zero. The settings stay. */
  reset() {
    const { rows, world, seen, inputs, settings } = this;
    const at = rows.inputs;
    this.describeRig();
    this.episode = 0;
    this.lost = null;
    world.set(rows.TICK, 0);
    seen.set(rows.TIME, 0);
    seen.fill(rows.OPENING, [0, 0, 0, 0]);
    inputs.set(at.begins, 0);
    inputs.fill(at.passages, new Array(at.given - at.passages).fill(0));
    inputs.set(at.keep_force, Number(settings.scenario_force));
    inputs.set(at.pointer_stiffness, settings.drag_stiffness);
    this.choose(chosen(settings));
    this.hands.act(inputs, at);
    this.beginSensors();
    inputs.set(at.sensors_begin, 0);
    this.plant.restart();
    const [target, setpoints] = this.scenario(settings.scenario).parts;
    this.run([this.enter, target, setpoints, this.outside, this.begin]);
    this.look();
    this.measure();
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
    const passes = [];
    const [now, then] = [chosen(after), chosen(before)];
    if (JSON.stringify(now) !== JSON.stringify(then)) {
      this.choose(now);
      passes.push("setpoints");
    }
    if (after.scenario_force !== before.scenario_force) {
      this.inputs.set(this.rows.inputs.keep_force, Number(after.scenario_force));
      passes.push("force");
    }
    if (after.sensors !== before.sensors) this.exchange(after.sensors);
    if (after.scenario !== before.scenario) {
      this.duration = this.scenario(after.scenario).duration;
      this.episode = 0;
      this.follow();
    } else if (passes.length) this.passOver(...passes);
    this.inputs.set(this.rows.inputs.pointer_stiffness, after.drag_stiffness);
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
    this.inputs.set(this.rows.inputs.begins, this.time);
    this.passOver(...this.pack.passes);
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
    const { seen } = this;
    const openings = this.law.openings(seen, this.sampled, this.settings.damping);
    if (openings === null) {
      this.lost = `${this.settings.controller} gives up: it has no gains for these setpoints.`;
      return;
    }
    seen.fill(this.rows.OPENING, openings);
    this.hands.act(this.inputs, this.rows.inputs);
    this.run([...this.valves[this.settings.valves], ...this.model.stages.slice(3), this.plant]);
    this.look();
    this.measure();
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
    const asked = this.inputs.some(this.rows.inputs.scenario_stiffness, 4);
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

/** What the person's hand does, or null: { position, id } of a hand at a place, { force, id } of one that pushes. */
class Hands {
  constructor() {
    this.hold = null;
    this.used = null;
  }

  /** Do so from now on. */
  act(inputs, at) {
    const { position, force, id } = this.hold ?? {};
    inputs.set(at.pointer_held, Number(Boolean(position)));
    if (position) inputs.fill(at.pointer, position);
    inputs.fill(at.push, force ?? [0, 0]);
    this.used = id ?? this.used;
  }

  /** Where the spring from `place` ends, or would end for a hand that pushes; nowhere where there is no hand. */
  pointer(place, stiffness) {
    const { position, force } = this.hold ?? {};
    return position ?? place.map((value, k) => (force ? value + force[k] / stiffness : NaN));
  }
}

function chosen({ stiffness_source: source, Kclx, Kcly, Kpneu1, Kpneu2 }) {
  return source === "sliders" ? [Kclx, Kcly, Kpneu1, Kpneu2] : null;
}
