// One memory with rows, constants and tables of one lane, and the stages of WebAssembly that run on them (birthsim_env/loop).

const PAGES = 256; // of 64 KiB: 16 MiB
const TABLE = 5; // whole numbers that describe a table

/** The bytes of a base64 text. */
export function bytesOf(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/** The doubles of a base64 text. */
export function doublesOf(text) {
  return new Float64Array(bytesOf(text).buffer);
}

export class Machine {
  /** `code` of the stages. */
  static async of(code) {
    return new Machine(await WebAssembly.compile(code));
  }

  constructor(module) {
    const memory = new WebAssembly.Memory({ initial: PAGES });
    const { exports } = new WebAssembly.Instance(module, { env: { memory } });
    this.module = module;
    this.exports = exports;
    this.buffer = memory.buffer;
    this.free = exports.__heap_base.value;
    this.nothing = { place: 0n };
    this.inputs = null; // rows that are the memory of several stages
  }

  /** The same code with a memory of its own. */
  another() {
    return new Machine(this.module);
  }

  /** Address of so many bytes that nothing else uses. */
  take(bytes) {
    const address = (this.free + 63) & ~63;
    if (address + bytes > this.buffer.byteLength) throw new Error("the rig's memory is full; reload the page");
    this.free = address + bytes;
    return address;
  }

  /** Address of a copy of some bytes. */
  put(bytes) {
    const address = this.take(bytes.length);
    new Uint8Array(this.buffer, address, bytes.length).set(bytes);
    return address;
  }

  rows(count) {
    return new Rows(this, count);
  }

  /** A stage of the pack. */
  stage(packed) {
    return new Stage(this, packed);
  }
}

/** Rows of one lane. */
export class Rows {
  constructor(machine, count) {
    const address = machine.take(8 * count);
    this.place = BigInt(address);
    this.values = new Float64Array(machine.buffer, address, count);
  }

  get(row) {
    return this.values[row];
  }

  set(row, value) {
    this.values[row] = value;
  }

  /** `count` rows from `row` on, as an array. */
  some(row, count) {
    return Array.from(this.values.subarray(row, row + count));
  }

  fill(row, values) {
    this.values.set(values, row);
  }

  /** Rows `from` to `to` as those of another lane. */
  copy(other, from, to) {
    this.values.set(other.values.subarray(from, to), from);
  }
}

/** A stage with what is its own: constants, memory and tables, in the machine's memory. */
export class Stage {
  constructor(machine, { function: number, constants, memory, tables }) {
    this.machine = machine;
    this.function = machine.exports[`birthsim_stage_${number}`];
    this.constants = BigInt(machine.put(bytesOf(constants)));
    this.fresh = memory === null || memory === "inputs" ? new Float64Array() : doublesOf(memory);
    this.memory = memory === "inputs" ? machine.inputs : machine.rows(this.fresh.length);
    const about = new BigInt64Array(TABLE * Math.max(tables.length, 1));
    this.tables = tables.map(({ shape, data }, k) => {
      const address = machine.put(bytesOf(data));
      about.set([address, ...shape].map(BigInt), TABLE * k);
      return address;
    });
    this.about = BigInt(machine.put(new Uint8Array(about.buffer)));
    this.restart();
  }

  /** Forget the past. */
  restart() {
    this.memory.fill(0, this.fresh);
  }

  /** Put the bytes of base64 text into table `k`. */
  fill(k, text) {
    const bytes = bytesOf(text);
    new Uint8Array(this.machine.buffer, this.tables[k], bytes.length).set(bytes);
  }

  /** One control period; false where the stage could not serve it. A law is run with no world. */
  run(seen, world = this.machine.nothing) {
    return this.function(world.place, seen.place, this.memory.place, this.constants, this.about) === 0n;
  }
}
