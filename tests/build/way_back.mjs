// Threads of a program in WebAssembly: node way_back.mjs FOLDER LANES PERIODS BARS
// A policy step of the files program, data and tape, and back from the bars, which stand in row BARS of the tape.
import { readFileSync, writeFileSync } from "node:fs";

const [folder, ...numbers] = process.argv.slice(2);
const [lanes, periods, row] = numbers.map(Number);
const { exports } = new WebAssembly.Instance(new WebAssembly.Module(readFileSync(`${folder}/code.wasm`)));
const names = ["program", "data", "tape", "bars"];
const files = names.map((name) => readFileSync(`${folder}/${name}`));
const places = [(exports.__heap_base.value + 15) & ~15];
files.forEach((file, k) => places.push(places[k] + file.length));
exports.memory.grow(Math.ceil(places.at(-1) / 65536));
const bytes = new Uint8Array(exports.memory.buffer);
files.forEach((file, k) => bytes.set(file, places[k]));
const [program, data, tape] = places;

/** Run a kernel for every lane. */
function run(name, threads, one, two) {
  for (let thread = 0; thread < threads; thread++) exports[`birthsim_${name}`](BigInt(thread), 0n, 32n, program, BigInt(one), BigInt(two));
}

run("place", 1, data, lanes);
run("advance", lanes, periods, tape);
bytes.set(files[3], tape + 8 * lanes * row);
run("backward", lanes, periods, tape);
writeFileSync(`${folder}/data`, bytes.subarray(data, tape));
writeFileSync(`${folder}/tape`, bytes.subarray(tape, tape + files[2].length));
