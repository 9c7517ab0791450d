// One memory with blocks of rows, constants and tables, and the stages of WebAssembly that run on them (birthsim_env/loop).

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
  /** `code` of the stages, `block` lanes between two rows of a block. */
  static async of(code, block) {
    const memory = new WebAssembly.Memory({ initial: PAGES });
    const { instance } = await WebAssembly.instantiate(code, { env: { memory } });
    return new Machine(instance.exports, memory, block);
  }

  constructor(exports, memory, block) {
    this.exports = exports;
    this.block = block;
    this.buffer = memory.buffer;
    this.doubles = new Float64Array(this.buffer);
    this.free = exports.__heap_base.value;
    this.nothing = { place: 0n };
  }

  /** Address of so many bytes that nothing else uses. */
  take(bytes) {
    const address = (this.free + 63) & ~63;
    this.free = address + bytes;
    if (this.free > this.buffer.byteLength) throw new Error("the rig's memory is full; reload the page");
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
  stage({ function: name, constants, memory, tables }) {
    const placed = tables.map(({ shape, data }) => ({ shape, address: this.put(bytesOf(data)) }));
    return new Stage(this, name, doublesOf(constants), placed, memory === null ? new Float64Array() : doublesOf(memory));
  }
}

/** A block of rows of one lane. */
export class Rows {
  constructor(machine, count) {
    this.count = count;
    this.address = machine.take(8 * count * machine.block);
    this.place = BigInt(this.address);
    this.doubles = machine.doubles;
    this.first = this.address / 8;
    this.stride = machine.block;
  }

  get(row) {
    return this.doubles[this.first + row * this.stride];
  }

  set(row, value) {
    this.doubles[this.first + row * this.stride] = value;
  }

  /** `count` rows from `row` on, as an array. */
  some(row, count) {
    return Array.from({ length: count }, (_, k) => this.get(row + k));
  }

  fill(row, values) {
    for (let k = 0; k < values.length; k += 1) this.set(row + k, values[k]);
  }

  /** Rows `from` to `to` as those of another block. */
  copy(other, from, to) {
    for (let row = from; row < to; row += 1) this.set(row, other.get(row));
  }
}

/** A stage with what is its own: constants, memory and tables (shape and address), in the machine's memory. */
export class Stage {
  constructor(machine, name, constants, tables, fresh = new Float64Array()) {
    this.machine = machine;
    this.function = machine.exports[name];
    this.constants = BigInt(machine.put(new Uint8Array(constants.buffer)));
    this.fresh = fresh;
    this.memory = machine.rows(fresh.length);
    this.tables = tables;
    const about = new BigInt64Array(TABLE * Math.max(tables.length, 1));
    tables.forEach(({ shape, address }, k) => about.set([address, ...shape].map(BigInt), TABLE * k));
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
    new Uint8Array(this.machine.buffer, this.tables[k].address, bytes.length).set(bytes);
  }

  /** One control period; false where the stage could not serve it. A law is run with no world. */
  run(seen, world = this.machine.nothing) {
    return this.function(world.place, seen.place, this.memory.place, this.constants, this.about, 0n, 1n) === 0n;
  }
}
