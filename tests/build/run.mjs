import { readFileSync, writeFileSync } from "node:fs";

const { folder, make, periods, names, out } = JSON.parse(process.argv[2]);
const { load } = await import(`${folder}/birthsim.js`);
const bundle = await load({ code: readFileSync(`${folder}/birthsim.wasm`), data: readFileSync(`${folder}/birthsim.bin`) });
const [method, ...given] = make;
const loop = bundle[method](...given);
const bytes = readFileSync(`${out}/inputs.bin`);
const values = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const kept = new Float64Array(periods * loop.rows.length);
for (let period = 0; period < periods; period++) {
  names.forEach((name, k) => loop.set(name, values[period * names.length + k]));
  if (loop.advance(1)) throw new Error(`a law could not serve in period ${period}`);
  kept.set(loop.rows, period * loop.rows.length);
}
writeFileSync(`${out}/rows.bin`, kept);
