// Many rigs side by side in WebAssembly: a policy step forward, kept on a tape, and its gradients back.

const PAGE = 65536;
const ALIGN = 16;
const MISSED = 6; // word of a program's head

/** `count` lanes of learn.wasm; `about` is learn.json, `data` learn.bin. Each begins where `begin` puts it. */
export class Lanes {
  constructor(module, about, data, count = about.lanes) {
    this.about = about;
    this.count = count;
    this.exports = new WebAssembly.Instance(module, {}).exports;
    const { program, rows, tape, horizon, beginnings, differs, mean } = about;
    const sizes = [program, rows * count, ...new Array(horizon).fill(tape * count)];
    const places = [(this.exports.__heap_base.value + ALIGN - 1) & -ALIGN];
    for (const words of sizes) places.push(places.at(-1) + 8 * words);
    const missing = places.at(-1) - this.exports.memory.buffer.byteLength;
    if (missing > 0) this.exports.memory.grow(Math.ceil(missing / PAGE));
    const { buffer } = this.exports.memory;
    [this.program, this.place, ...this.tapes] = places;
    this.words = new BigInt64Array(buffer, this.program, program);
    this.data = new Float64Array(buffer, this.place, rows * count);
    this.bars = this.tapes.slice(0, horizon).map((place) => new Float64Array(buffer, place, tape * count));
    this.seen = new Float32Array(buffer, this.place + 8 * about.at.seen * count, mean.length * count);
    this.words.set(new BigInt64Array(data, 0, program));
    this.first = new Float64Array(data, 8 * program, rows);
    this.differing = new Float64Array(data, 8 * (program + rows), differs.length * beginnings);
    this.seenFirst = new Float32Array(data, 8 * (program + rows + differs.length * beginnings), mean.length * beginnings);
    this.run("place", 1, this.place, count);
  }

  run(name, threads, one, two) {
    const [width, first, second] = [32n, BigInt(one), BigInt(two)];
    for (let lane = 0; lane < threads; lane += 1) this.exports[`birthsim_${name}`](BigInt(lane), 0n, width, this.program, first, second);
  }

  /** The row `k` of the data, one number a lane. */
  row(k) {
    return this.data.subarray(k * this.count, (k + 1) * this.count);
  }

  /** Put a beginning into a lane. */
  begin(lane, beginning) {
    const { data, count, seen } = this;
    const { differs, beginnings, at, mean: { length } } = this.about;
    const behind = at.seen + Math.ceil(length / 2); // observations, of 32 bits, stand lane by lane
    this.first.forEach((value, k) => {
      if (k < at.seen || k >= behind) data[k * count + lane] = value;
    });
    differs.forEach((row, k) => {
      data[row * count + lane] = this.differing[k * beginnings + beginning];
    });
    seen.set(this.seenFirst.subarray(beginning * length, (beginning + 1) * length), lane * length);
  }

  /** The `k`-th policy step of a horizon under actions (lanes, 4), in [-1, 1]. */
  step(k, actions) {
    const { at, periods, bars } = this.about;
    const { count } = this;
    for (let lane = 0; lane < count; lane += 1) {
      bars.action.forEach((_, i) => {
        this.data[(at.action + i) * count + lane] = actions[lane * bars.action.length + i];
      });
    }
    this.row(at.impacts).fill(0);
    this.row(at.impacts + 1).fill(0);
    this.run("advance", count, periods, this.tapes[k]);
    if (this.words[MISSED]) throw new Error("a rig could not be served");
  }

  /**
   * Back through the `k`-th step, which ended where `lives` (lanes,) is 0: `rewards` (lanes,) and `seen` (lanes, D) are gradients
   * to what it led to, and what the step behind it left is added. Writes gradients to its actions (lanes, 4).
   */
  back(k, lives, rewards, seen, actions) {
    const { bars, live: [first, rows], periods, mean: { length } } = this.about;
    const { count } = this;
    const [own, behind] = [this.bars[k], this.bars[k + 1]];
    own.fill(0, first * count, (first + rows) * count);
    for (let lane = 0; lane < count; lane += 1) {
      if (behind) for (const row of bars.carried) own[row * count + lane] = lives[lane] && behind[row * count + lane];
      own[bars.reward[0] * count + lane] = rewards[lane];
      for (let i = 0; i < length; i += 1) own[bars.observation[i] * count + lane] += lives[lane] * seen[lane * length + i];
    }
    this.run("backward", count, periods, this.tapes[k]);
    for (let lane = 0; lane < count; lane += 1) {
      bars.action.forEach((row, i) => {
        actions[lane * bars.action.length + i] = own[row * count + lane];
      });
    }
  }
}
