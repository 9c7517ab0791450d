// A trained policy (agents/policy): reads its safetensors file and evaluates its network with the stage of a layer.

import { Stage } from "./machine.js";

const KEY = "birthsim";

/** Arrays and what is said about them in the content of a safetensors file. */
export function readSafetensors(content) {
  const size = Number(new DataView(content).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(content, 8, size)));
  const { __metadata__: metadata, ...entries } = header;
  const arrays = {};
  for (const [name, { dtype, shape, data_offsets: [from, to] }] of Object.entries(entries)) {
    const kind = { F32: Float32Array, F64: Float64Array }[dtype];
    if (!kind) throw new Error(`array ${name} of the policy is ${dtype}; allowed: F32, F64`);
    // A copy: in the file, doubles need not lie at multiples of 8 bytes.
    arrays[name] = { shape, data: new kind(content.slice(8 + size + from, 8 + size + to)) };
  }
  return { arrays, about: JSON.parse(metadata[KEY]) };
}

export class Network {
  /** `layer` is the function of the stage, `about` what the pack says of the policy. */
  constructor(machine, layer, content, { clip, epsilon }) {
    const { arrays, about } = readSafetensors(content);
    this.machine = machine;
    this.clip = clip;
    this.mean = arrays.mean.data;
    this.scale = arrays.variance.data.map((variance) => Math.sqrt(variance + epsilon));
    this.layers = [];
    const count = Object.keys(arrays).filter((name) => name.endsWith(".weight")).length;
    this.input = this.vector(this.mean.length);
    let before = this.input;
    for (let k = 0; k < count; k += 1) {
      const { shape: [outputs, inputs], data } = arrays[`${k}.weight`];
      const after = this.vector(outputs);
      const weight = Float32Array.from(data, (_, i) => data[(i % outputs) * inputs + Math.floor(i / outputs)]);
      const table = (array, shape) => ({ shape, address: machine.put(new Uint8Array(array.buffer)) });
      const squashed = Float64Array.of(k + 1 < count || about.squashed ? 1 : 0);
      const tables = [before.table, table(weight, [inputs, outputs]), table(arrays[`${k}.bias`].data, [1, outputs]), after.table];
      this.layers.push(new Stage(machine, layer, squashed, tables));
      before = after;
    }
    this.output = before;
  }

  vector(count) {
    const address = this.machine.take(8 * count);
    return { table: { shape: [1, count], address }, values: new Float64Array(this.machine.buffer, address, count) };
  }

  /** Actions in [-1, 1], rounded to single precision, for an observation of single precision. */
  actions(observation) {
    const { clip, mean, scale } = this;
    for (let k = 0; k < mean.length; k += 1) {
      this.input.values[k] = Math.min(Math.max((observation[k] - mean[k]) / scale[k], -clip), clip);
    }
    for (const layer of this.layers) layer.run(this.machine.nothing);
    return Array.from(this.output.values, (value) => Math.fround(Math.min(Math.max(value, -1), 1)));
  }
}
