// The policy gradient of agents/training/by_gradients: a short horizon forward and back in many lanes, and a step of Adam.

import { Lanes } from "./lanes.js";
import { Adam, Network } from "./network.js";

const STEP = 0.01; // s that a reward of one is for
const UNTAUGHT = 10; // horizons before the first update: lanes begin on their targets, where there is nothing to learn

export class Learner {
  /** `module` is learn.wasm compiled, `about` learn.json, `data` learn.bin; `seed` a whole number. */
  constructor(module, about, data, seed = 1) {
    Object.assign(this, { about, random: generator(seed), done: 0 });
    this.lanes = new Lanes(module, about, data);
    this.widths = [about.mean.length, ...about.hidden, about.bars.action.length];
    this.network = new Network(this.widths);
    this.network.begin(this.random);
    this.adam = new Adam(this.network, about.moments);
    const { count } = this.lanes;
    // Lanes are at different moments of their episodes.
    this.left = Array.from({ length: count }, (_, lane) => about.steps - Math.floor((lane * about.steps) / count));
    for (let lane = 0; lane < count; lane += 1) this.lanes.begin(lane, this.draw());
  }

  /** Let the network that has learned nothing lose its targets. */
  settle() {
    for (let k = 0; k < UNTAUGHT; k += 1) this.forward();
  }

  /** Share of all updates that is done, at most 1. */
  get share() {
    return Math.min(1, this.done / this.about.updates);
  }

  /** The network as it is: `widths` and `weights`, `mean` and `deviation` of what it sees. */
  learned() {
    const { mean, deviation } = this.about;
    return { widths: this.widths, weights: Float32Array.from(this.network.weights), mean, deviation };
  }

  draw() {
    return Math.floor(this.random() * this.about.beginnings);
  }

  begin(lane) {
    this.left[lane] = this.about.steps;
    this.lanes.begin(lane, this.draw());
  }

  /** Observations in standard deviations from their mean. */
  normalized() {
    const { mean, deviation, clip } = this.about;
    const { seen } = this.lanes;
    return Float64Array.from(seen, (value, k) => {
      const i = k % mean.length;
      return Math.min(Math.max((value - mean[i]) / deviation[i], -clip), clip);
    });
  }

  /** A horizon forward: what each step saw, did, was paid for, and where it ended an episode. */
  forward() {
    const { lanes, about } = this;
    const steps = [];
    for (let k = 0; k < about.horizon; k += 1) {
      const passed = this.network.forward(this.normalized(), lanes.count);
      lanes.step(k, passed.at(-1));
      steps.push({ passed, rewards: lanes.row(about.at.reward).slice(), seen: lanes.seen.slice(), lives: this.endSome() });
    }
    return steps;
  }

  /** Lanes whose episode is over begin anew; 0 in these, 1 in others. */
  endSome() {
    const terminated = this.lanes.row(this.about.at.terminated);
    return Float64Array.from(this.left, (_, lane) => {
      this.left[lane] -= 1;
      const ends = terminated[lane] > 0 || this.left[lane] === 0;
      if (ends) this.begin(lane);
      return ends ? 0 : 1;
    });
  }

  /** Gradients of what a horizon costs, in means over lanes, to the weights. */
  back(steps) {
    const { lanes: { count }, about, network } = this;
    const size = about.mean.length;
    const actions = new Float64Array(count * about.bars.action.length);
    let later = new Float64Array(count * size);
    network.gradient.fill(0);
    for (let k = steps.length - 1; k >= 0; k -= 1) {
      const { passed, rewards, seen, lives } = steps[k];
      this.addStiffness(seen, later);
      this.lanes.back(k, lives, rewards.map((reward) => this.slope(reward) / count), later, actions);
      later = network.back(passed, actions, count);
      for (let i = 0; i < later.length; i += 1) {
        later[i] *= Math.abs(passed[0][i]) < about.clip ? 1 / about.deviation[i % size] : 0;
      }
    }
  }

  /** What a step costs goes with its reward by this much: it counts millimetres, and the reward their logarithm. */
  slope(reward) {
    const { largest_cost: most, periods, period } = this.about;
    const unit = STEP / (periods * period);
    return -most * unit * Math.exp(most * (1 - reward * unit));
  }

  /** Errors of the pneumatic stiffness cost too. */
  addStiffness(seen, bars) {
    const { stiffness: [has, asked, weight], mean: { length } } = this.about;
    const { count } = this.lanes;
    for (let lane = 0; lane < count; lane += 1) {
      for (const cylinder of [0, 1]) {
        const [one, other] = [lane * length + has + cylinder, lane * length + asked + cylinder];
        const slope = (weight / count) * Math.sign(seen[one] - seen[other]);
        bars[one] += slope;
        bars[other] -= slope;
      }
    }
  }

  /** One update; the error in mm, a median over lanes and steps. */
  update() {
    const { about } = this;
    const steps = this.forward();
    this.back(steps);
    this.done += 1;
    this.adam.step(about.rate * (about.least_rate + (1 - about.least_rate) * (1 - this.share)));
    // A policy that meets more rigs is lost on fewer.
    const share = (about.horizon * about.periods * about.period) / about.met;
    this.left.forEach((_, lane) => this.random() < share && this.begin(lane));
    return this.error(steps);
  }

  error(steps) {
    const { error: [first, unit], mean: { length } } = this.about;
    const all = steps.flatMap(({ seen }) => this.left.map((_, lane) => Math.hypot(seen[lane * length + first], seen[lane * length + first + 1])));
    return 1e3 * unit * all.sort((a, b) => a - b)[Math.floor(all.length / 2)];
  }
}

/** Numbers between 0 and 1, the same for the same seed (mulberry32). */
function generator(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let bits = Math.imul(state ^ (state >>> 15), 1 | state);
    bits = (bits + Math.imul(bits ^ (bits >>> 7), 61 | bits)) ^ bits;
    return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
  };
}
