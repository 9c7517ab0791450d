/**
 * Closed loops of BirthSIM, compiled to WebAssembly: the same bits as in Python. Types are in birthsim.d.ts, rows in layout.js.
 *
 *     import { load } from "./birthsim.js";
 *     const bundle = await load();
 *     const loop = bundle.loop({ scenario: "circle", sensors: "ideal", controller: "backstepping" });
 *     loop.advance(10);
 *     console.log(loop.get("x"), loop.get("y"));
 */
import { HEAD, INDEX, LEFT_OUT, MAGIC, ROW, ROWS } from "./layout.js";

export { INDEX, ROW, ROWS };

const PAGE = 65536;
const PART_HEAD = 4, ENTRY = 4, DIMENSIONS = 4; // words of a part's head and of a stage in it, and of the shape of a table

/** Load code and data from a folder (its URL; default: that of this module), or from bytes that are given. */
export async function load(from = new URL("./", import.meta.url)) {
  const given = typeof from !== "string" && !(from instanceof URL);
  const [code, data] = given ? [from.code, from.data] : await Promise.all(["birthsim.wasm", "birthsim.bin"].map((name) => read(new URL(name, from))));
  return new Bundle(await WebAssembly.compile(code), new BigInt64Array(toBuffer(data)));
}

async function read(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url}: ${answer.status} ${answer.statusText}`);
  return answer.arrayBuffer();
}

/** An ArrayBuffer of its own, so that words are aligned. */
function toBuffer(data) {
  return data instanceof ArrayBuffer ? data : data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
}

function pick(kind, table, name) {
  if (!Object.hasOwn(table, name)) throw new RangeError(`${kind} = ${JSON.stringify(name)}; allowed: ${Object.keys(table).join(", ")}`);
  return table[name];
}

/** Code, and the parts of which loops are made. */
export class Bundle {
  constructor(module, words) {
    this.module = module;
    this.words = words;
    this.period = INDEX.period;
  }

  /** A closed loop where an episode begins. */
  loop({ scenario, sensors = "ideal", controller, valves = "two_valves" }) {
    const world = pick("sensors", pick("scenario", INDEX.scenarios, scenario).sensors, sensors);
    const parts = { ...world.parts, law: this.law(controller, sensors) };
    if (valves === "one_valve") parts.valves = INDEX.one_valve;
    else if (valves !== "two_valves") throw new RangeError(`valves = ${JSON.stringify(valves)}; allowed: two_valves, one_valve`);
    return new Loop(this, this.rows(world.rows), parts);
  }

  /** The number of the part that is a controller's law, for Loop.exchange. */
  law(controller, sensors = "ideal") {
    const kinds = pick("controller", INDEX.controllers, controller);
    return pick("sensors", kinds, pick("sensors", INDEX.sensors, sensors) ? "sampled" : "exact");
  }

  /** The plant alone: openings and force in, state out. */
  plant() {
    return new Loop(this, this.rows(INDEX.plant.rows), INDEX.plant.parts);
  }

  /** A law alone: measurements and reference in, openings out. */
  controller(controller, sensors = "ideal") {
    return new Loop(this, this.rows(INDEX.zero), { law: this.law(controller, sensors) });
  }

  /** @private */
  rows(start) {
    return this.words.slice(start, start + ROWS);
  }

  /** @private */
  part(number) {
    const { start, words } = INDEX.parts[number];
    return this.words.subarray(start, start + words);
  }
}

/** Control periods of one rig, in a memory of its own. */
export class Loop {
  /** Use the methods of Bundle. */
  constructor(bundle, rows, parts) {
    this.bundle = bundle;
    this.first = { rows, parts };
    this.exports = new WebAssembly.Instance(bundle.module, {}).exports;
    this.base = (this.exports.__heap_base.value + 15) & ~15;
    this.reset();
  }

  /** Where an episode begins, with the parts that the loop was made with. */
  reset() {
    this.parts = INDEX.order.filter((name) => name in this.first.parts).map((name) => [name, this.first.parts[name]]);
    this.put(this.first.rows, this.parts.map(([, number]) => this.bundle.part(number)));
    for (const [, number] of this.parts) this.begin(number);
  }

  /** Run control periods, of the parts `only` where they are named; returns how many times a law could not serve its setpoint. */
  advance(periods = 1, only = null) {
    if (!this.masks.has(only)) {
      const bits = this.parts.map(([name], k) => (only && !only.includes(name) ? 1n << BigInt(k) : 0n));
      this.masks.set(only, bits.reduce((mask, bit) => mask | bit, 0n));
    }
    this.words[LEFT_OUT] = this.masks.get(only);
    return this.exports.birthsim_advance(this.base, periods);
  }

  /** Value of a row, by its name in ROW. */
  get(name) {
    return this.rows[pick("row", ROW, name)];
  }

  /** Set a row: an input, a parameter of the rig, an opening or a force. */
  set(name, value) {
    this.rows[pick("row", ROW, name)] = value;
  }

  /**
   * Exchange a part for another, such as the law, while the rig keeps its state; the new part begins anew.
   * @param {string} name of the part in INDEX.order
   * @param {number} [number] of the new part in INDEX.parts; without it there is none
   */
  exchange(name, number) {
    if (!INDEX.order.includes(name)) throw new RangeError(`part = ${JSON.stringify(name)}; allowed: ${INDEX.order.join(", ")}`);
    const now = new Map();
    let at = HEAD + ROWS;
    for (const [own] of this.parts) {
      const words = Number(this.words[at]);
      now.set(own, this.words.slice(at, at + words));
      at += words;
    }
    if (number === undefined) now.delete(name);
    else now.set(name, this.bundle.part(number));
    const numbers = new Map(this.parts).set(name, number);
    this.parts = INDEX.order.filter((own) => now.has(own)).map((own) => [own, numbers.get(own)]);
    this.put(this.words.slice(HEAD, HEAD + ROWS), this.parts.map(([own]) => now.get(own)));
    if (number !== undefined) this.begin(number);
  }

  /** What the first stage of a part remembers. */
  memory(name) {
    const at = this.find(name);
    const [from, to] = [5, 6].map((k) => Number(this.words[at + k])); // its constants come behind it
    return new Float64Array(this.words.buffer, this.words.byteOffset + 8 * (at + from), to - from);
  }

  /** The `k`-th table of a part, as an array of its kind, such as Float32Array. */
  table(name, k, Kind) {
    const at = this.find(name);
    const entry = at + PART_HEAD + ENTRY * Number(this.words[at + 1]) + 2 * k;
    const [about, from] = [0, 1].map((word) => at + Number(this.words[entry + word]));
    const size = this.words.slice(about + 1, about + 1 + DIMENSIONS).reduce((product, length) => product * (Number(length) || 1), 1);
    return new Kind(this.words.buffer, this.words.byteOffset + 8 * from, size);
  }

  /** @private The word at which a part begins. */
  find(name) {
    let at = HEAD + ROWS;
    for (const [own] of this.parts) {
      if (own === name) break;
      at += Number(this.words[at]);
    }
    return at;
  }

  /** @private Write an image. */
  put(rows, parts) {
    const total = parts.reduce((sum, part) => sum + part.length, HEAD + ROWS);
    const missing = this.base + 8 * total - this.exports.memory.buffer.byteLength;
    if (missing > 0) this.exports.memory.grow(Math.ceil(missing / PAGE));
    this.words = new BigInt64Array(this.exports.memory.buffer, this.base, total);
    this.rows = new Float64Array(this.exports.memory.buffer, this.base + 8 * HEAD, ROWS);
    this.words.fill(0n, 0, HEAD);
    this.masks = new Map();
    [MAGIC, BigInt(total), BigInt(parts.length), BigInt(ROWS)].forEach((word, k) => (this.words[k] = word));
    this.words.set(rows, HEAD);
    let at = HEAD + ROWS;
    for (const part of parts) {
      this.words.set(part, at);
      at += part.length;
    }
  }

  /** @private Rows with which a part begins. */
  begin(number) {
    for (const [row, value] of INDEX.parts[number].rows) this.rows[row] = value;
  }
}
