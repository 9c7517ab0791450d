// A rig that a person plays with, and one beside it to compare: control periods, no clock.

import { INDEX, Loop, ROW } from "../rig/birthsim.js";
import { Hands } from "./hands.js";
import { putNetwork } from "./learned.js";
import { Remote } from "./remote.js";
import { LEARNING, NOTHING, STIFFNESSES, merged } from "./settings.js";

// Parts that run together.
const LAW = ["policy", "law"];
const ASK = ["clock", "target", "setpoints", "hand", "inputs"];
const START = ["clock", "target", "setpoints", "inputs", "start", "rest"];
const MEASURE = ["sensors"];
const MOVE = ["valves", "board", "plant", ...ASK, ...MEASURE];
const SHOW = ["show"];
// Parts that are exchanged together.
const SCENARIO = ["target", "setpoints", "hand"];
const SENSORS = ["sensors", "board"];
const STATES = 18;
const PASSES = ["target", "setpoints", "force"]; // what can pass over smoothly

export class Session {
  /** `bundle` of code and parts. */
  constructor(pack, bundle, settings = pack.hello.defaults) {
    this.pack = pack;
    this.bundle = bundle;
    this.numbers = pack.numbers;
    this.period = bundle.period;
    this.settings = { ...settings };
    this.lost = null;
    this.paths = 0;
    this.recorder = null;
    this.second = null; // the rig beside it: the same world, settings and hand under the controller `settings.compare`
    this.remote = null; // the controller, where it runs in Python
    this.network = null; // what the controller LEARNING has learned
    this.hands = new Hands();
    this.loop = new Loop(bundle, bundle.rows(INDEX.zero), pack.parts.rig);
    this.put(["valves"], pack.parts.valves[settings.valves]);
    this.reset();
  }

  /** s since the last reset. */
  get time() {
    return this.loop.get("time");
  }

  /** s since the scenario's present episode began. */
  get episodeTime() {
    return this.time - this.loop.get("begins");
  }

  get duration() {
    return this.pack.scenarios[this.settings.scenario].duration;
  }

  /** `count` rows from the one called `name` on. */
  some(name, count) {
    return Array.from(this.loop.rows.subarray(ROW[name], ROW[name] + count));
  }

  fill(name, values) {
    this.loop.rows.set(values, ROW[name]);
  }

  /** What the part `show` makes of this instant. */
  shown() {
    this.loop.advance(1, SHOW);
    return this.loop.memory("show");
  }

  put(names, parts) {
    for (const name of names) this.loop.exchange(name, parts[name]);
  }

  /** A fresh controller, for what the last measurement was. */
  putLaw() {
    const { parts, python, damped } = this.pack;
    const { controller } = this.settings;
    this.lawSampled = this.sampled;
    this.remote?.close();
    this.remote = python.includes(controller) ? new Remote(controller) : null;
    this.put(LAW, this.remote ? {} : parts.controllers[controller][this.sampled ? "sampled" : "exact"]);
    if (controller === LEARNING) putNetwork(this.loop, this.network);
    this.damped = Boolean(damped[controller]);
    this.loop.set("damping_factor", 0);
  }

  /** What the controller LEARNING has learned by now: `network` as of learned.js. */
  teach(network) {
    this.network = network;
    if (this.settings.controller === LEARNING) putNetwork(this.loop, network);
    this.second?.teach(network);
  }

  putSensors() {
    const episodes = this.pack.parts.sensors[this.settings.sensors];
    this.put(SENSORS, episodes[this.episode % episodes.length]);
    this.loop.set("sensors_begin", this.loop.get("tick") + 1);
  }

  putScenario() {
    this.put(SCENARIO, this.pack.parts.scenarios[this.settings.scenario]);
  }

  measured() {
    this.sampled = this.pack.sampled[this.settings.sensors];
  }

  /** Let what has been changed (of PASSES) pass over smoothly from this instant on. */
  passOver(...what) {
    PASSES.forEach((name) => this.loop.set(`pass_${name}`, Number(what.includes(name))));
    this.loop.advance(1, ASK);
  }

  /** Ask for setpoints that are chosen, or for the scenario's. */
  choose(values) {
    this.fill("keep_Kclx", new Array(7).fill(values ? 0 : 1));
    this.fill("add_Kclx", values ?? [0, 0, 0, 0]);
  }

  /** Start the scenario anew: pistons on the target, in balance, at time zero. The settings stay. */
  reset() {
    const { loop, settings } = this;
    this.episode = 0;
    this.lost = null;
    this.putScenario();
    this.putSensors();
    this.describeRig();
    for (const name of ["tick", "time", "begins", "sensors_begin"]) loop.set(name, 0);
    this.fill("opening_P1", [0, 0, 0, 0]);
    loop.rows.fill(0, ROW.passages_target_begins, ROW.given_x);
    loop.set("keep_force", Number(settings.scenario_force));
    loop.set("pointer_stiffness", settings.drag_stiffness);
    this.choose(chosen(settings));
    this.hands.act(this);
    loop.advance(1, START);
    loop.memory("plant").set(loop.memory("rest").subarray(0, loop.memory("plant").length));
    for (const parts of [ASK, MEASURE]) loop.advance(1, parts);
    this.measured();
    this.putLaw();
    this.paths += 1;
    if (!this.second) return;
    this.second.hands.hold = this.hands.hold;
    this.second.reset();
  }

  /** Write the rig that moves: mass and friction as set. */
  describeRig() {
    const { column, free, coulomb, pressed, viscous } = this.pack.rig;
    const { mass, friction } = this.settings;
    this.loop.rows.set(column);
    this.loop.set("rig_mass", mass);
    this.loop.set("rig_inverse_mass", 1 / mass);
    this.loop.set("rig_inverse_mass1", free / mass);
    coulomb.forEach((force, k) => {
      this.loop.set(`rig_fc${k + 1}`, force * friction);
      this.loop.set(`rig_fp${k + 1}`, pressed[k] * friction);
      this.loop.set(`rig_fv${k + 1}`, viscous[k] * friction);
    });
  }

  /** Apply checked settings; the rig keeps its state and its motion, unless another pair of controllers is to be compared. */
  change(changes) {
    const before = this.settings;
    const after = merged(before, changes, this.scenarioSetpoints());
    this.settings = after;
    if (after.controller !== before.controller) this.putLaw();
    this.describeRig();
    const passes = [];
    const [now, then] = [chosen(after), chosen(before)];
    if (JSON.stringify(now) !== JSON.stringify(then)) {
      this.choose(now);
      passes.push("setpoints");
    }
    if (after.scenario_force !== before.scenario_force) {
      this.loop.set("keep_force", Number(after.scenario_force));
      passes.push("force");
    }
    if (after.sensors !== before.sensors) this.putSensors();
    if (after.valves !== before.valves) this.put(["valves"], this.pack.parts.valves[after.valves]);
    if (after.scenario !== before.scenario) {
      this.episode = 0;
      this.follow();
    } else if (passes.length) this.passOver(...passes);
    this.loop.set("pointer_stiffness", after.drag_stiffness);
    this.compare(before, changes);
  }

  /** Let the second rig follow the settings, come or go. */
  compare(before, { controller, compare, ...others }) {
    const now = this.settings;
    if (this.second && now.compare === before.compare) this.second.change(others);
    else {
      this.second?.remote?.close();
      this.second = now.compare === NOTHING ? null : new Session(this.pack, this.bundle, { ...now, controller: now.compare, compare: NOTHING });
      this.second?.teach(this.network);
    }
    if (this.second && (now.controller !== before.controller || now.compare !== before.compare)) this.reset();
  }

  /** Go over to the start of an episode of the scenario. */
  follow() {
    this.putScenario();
    this.loop.set("begins", this.time);
    this.passOver(...PASSES);
    this.paths += 1;
  }

  /** Run up to `periods` control periods, none begun after `until` (ms of performance.now), at least one; how many. */
  async advance(periods, until) {
    let done = 0;
    while (done < periods && !this.halted && (done === 0 || performance.now() < until)) {
      const waited = [this, this.second].filter((one) => one?.remote);
      if (waited.length) await Promise.all(waited.map((one) => one.remote.ask(one)));
      if (this.halted || [this, this.second].some((one) => one?.remote && !one.remote.answered)) break; // changed meanwhile
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
    const { loop, settings } = this;
    if (this.sampled !== this.lawSampled && !this.remote) this.putLaw();
    if (this.damped) loop.set("damping_factor", settings.damping);
    const missed = loop.advance(1, LAW) && "it has no gains for these setpoints.";
    const fault = this.remote ? this.remote.act(this) : missed;
    if (fault) {
      this.lost = `${settings.controller} gives up: ${fault}`;
      return;
    }
    this.hands.act(this);
    loop.advance(1, MOVE);
    this.measured();
    this.lost = this.leftRange();
    if (this.lost === null && this.episodeTime > this.duration - this.period / 2) {
      this.episode += 1;
      this.follow();
    }
  }

  leftRange() {
    const { pack, loop } = this;
    const name = Object.keys(pack.range).find((one) => !(loop.get(one) > pack.range[one][0] && loop.get(one) < pack.range[one][1]));
    if (!loop.rows.subarray(ROW.y1, ROW.y1 + STATES).every(Number.isFinite)) return "the state is no longer finite";
    if (!name) return null;
    const [kind, unit] = name.startsWith("P") ? ["pressure", "Pa"] : ["temperature", "K"];
    const words = [loop.get(name), ...pack.range[name]].map((value) => Number(value.toPrecision(6)));
    return `${kind} of chamber ${name.slice(1).toUpperCase()} = ${words[0]} ${unit}; the model holds from ${words[1]} to ${words[2]}`;
  }

  /** Both rigs stand still where one is lost. */
  get halted() {
    return this.lost !== null || Boolean(this.second?.lost);
  }

  /** What the scenario asks for at this time. */
  scenarioSetpoints() {
    const asked = this.some("scenario_Kclx", 4);
    return Object.fromEntries(STIFFNESSES.map((name, k) => [name, Math.round(1e3 * asked[k]) / 1e3]));
  }

  /** The settings as the page shows them: with the scenario's setpoints where they hold. */
  shownSettings() {
    const given = this.settings.stiffness_source === "scenario" ? this.scenarioSetpoints() : {};
    return { ...this.settings, ...given, damping_applies: this.damped || Boolean(this.second?.damped) };
  }

  path() {
    return this.pack.scenarios[this.settings.scenario].path;
  }
}

function chosen({ stiffness_source: source, Kclx, Kcly, Kpneu1, Kpneu2 }) {
  return source === "sliders" ? [Kclx, Kcly, Kpneu1, Kpneu2] : null;
}
