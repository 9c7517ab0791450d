import { readFileSync, writeFileSync } from "node:fs";

const { folder, make, periods, names, out, exchange } = JSON.parse(process.argv[2]);
const { load } = await import(`${folder}/birthsim.js`);
const bundle = await load({ code: readFileSync(`${folder}/birthsim.wasm`), data: readFileSync(`${folder}/birthsim.bin`) });
const [method, ...given] = make;
const loop = bundle[method](...given);
const bytes = readFileSync(`${out}/inputs.bin`);
const values = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const kept = new Float64Array(periods * loop.rows.length);
loop.advance(17);
loop.reset();
for (let period = 0; period < periods; period++) {
  if (exchange && exchange.at === period) loop.exchange("law", bundle.law(exchange.controller, exchange.sensors));
  names.forEach((name, k) => loop.set(name, values[period * names.length + k]));
  if (loop.advance(1)) throw new Error(`a law could not serve in period ${period}`);
  kept.set(loop.rows, period * loop.rows.length);
}
writeFileSync(`${out}/rows.bin`, kept);
loop.reset();
let done = 0;
const started = process.cpuUsage();
const spent = () => process.cpuUsage(started).user / 1e6;
while (spent() < 0.5) {
  loop.advance(1000);
  done += 1000;
}
console.log(done / spent());
