// Reads a recording in the browser; birthsim_live/logs/recording.py has the format.

import { crc32 } from "../crc32.js";
import { FIELDS } from "../frame.js";

const RIGS = { "birthsim-recording-2": 1, "birthsim-recording-3": 2 }; // format -> how many rigs a row holds
const LARGEST = 2 ** 27; // bytes, packed or not
const [WORDS, CHUNKS] = [2 ** 24, 2 ** 17]; // bytes of JSON, and chunks
const SETTING = ["string", "number", "boolean"]; // what a setting can be
const HEAD = 8; // bytes before a chunk
const FIRST_COLUMNS = Object.keys(FIELDS).filter((name) => !["friction", "flows"].includes(name)); // what older files hold

/** The recording in a file: { name, header, rows, width, rigs, columns, events, interval, duration }; an Error says what is wrong. */
export async function readRecording(file) {
  try {
    if (file.size > LARGEST) throw new Error(`it has ${file.size} bytes; allowed: up to ${LARGEST}`);
    const chunks = await unpacked(new Uint8Array(await file.arrayBuffer()));
    if (!chunks.length) throw new Error("no chunk is whole");
    return { name: file.name, ...checked(chunks) };
  } catch (error) {
    throw new Error(`recording = '${file.name}' is damaged or foreign (${error.message}); allowed: what birthsim live wrote`);
  }
}

/** What the chunks say, and the numbers of their rows; the last one is left out where it is not whole. */
async function unpacked(content) {
  const view = new DataView(content.buffer);
  const chunks = [];
  let [place, claimed, words] = [0, 0, 0];
  while (place + HEAD <= content.length) {
    const [length, digest] = [view.getUint32(place, true), view.getUint32(place + 4, true)];
    const chunk = content.subarray(place + HEAD, place + HEAD + length);
    place += HEAD + length;
    if (chunk.length < length || crc32(chunk) !== digest) {
      if (place < content.length) throw new Error(`the chunk at byte ${place - length - HEAD} has another checksum`);
      break;
    }
    const raw = await inflated(chunk, LARGEST - claimed);
    claimed += raw.length;
    const end = raw.indexOf(10);
    words += end;
    if (words > WORDS) throw new Error(`it holds more than ${WORDS} bytes of JSON; allowed: up to ${WORDS}`);
    if (chunks.length === CHUNKS) throw new Error(`it holds more than ${CHUNKS} chunks; allowed: up to ${CHUNKS}`);
    const numbers = new Float64Array(raw.slice(end + 1).buffer);
    chunks.push({ said: JSON.parse(new TextDecoder().decode(raw.subarray(0, end))), numbers });
  }
  return chunks;
}

/** The bytes of a packed chunk, `most` of them at most. */
async function inflated(chunk, most) {
  const reader = new Blob([chunk]).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
  const pieces = [];
  let size = 0;
  for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
    size += piece.value.length;
    if (size > most) throw new Error(`it holds more than ${LARGEST} bytes; allowed: up to ${LARGEST}`);
    pieces.push(piece.value);
  }
  return new Uint8Array(await new Blob(pieces).arrayBuffer());
}

const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);

function checked([{ said: header }, ...chunks]) {
  const { format, columns, interval, rig } = header;
  const known = same(columns, Object.keys(FIELDS)) || same(columns, FIRST_COLUMNS);
  const rigs = RIGS[format];
  if (!rigs || !known) throw new Error(`format ${JSON.stringify(format)}; allowed: ${Object.keys(RIGS).join(", ")}`);
  if (!(interval > 0 && interval <= 1)) throw new Error(`interval ${interval}; allowed: more than 0 and up to 1 s`);
  if (typeof rig?.geometry !== "object") throw new Error("it holds no rig");
  const width = rigs * columns.reduce((sum, name) => sum + FIELDS[name], 0);
  const size = chunks.reduce((sum, { numbers }) => sum + numbers.length, 0);
  if (size === 0 || size % width) throw new Error(`${size} numbers; allowed: some rows of ${width}`);
  const rows = new Float64Array(size);
  let place = 0;
  for (const { numbers } of chunks) {
    rows.set(numbers, place);
    place += numbers.length;
  }
  const events = chunks.flatMap(({ said }) => said.events);
  if (!events.every(fits)) throw new Error("an event is none; allowed: a row, and settings, a path or lost");
  return { header, rows, width, rigs, columns, events, interval, duration: (size / width - 1) * interval };
}

function fits(event) {
  if (!Number.isInteger(event?.row)) return false;
  const { settings, path, lost = event.second_lost } = event;
  if (settings !== undefined) return typeof settings === "object" && settings !== null && Object.values(settings).every((value) => SETTING.includes(typeof value));
  if (path !== undefined) return Array.isArray(path) && path.every((point) => point.length === 2 && point.every(Number.isFinite));
  return lost === null || typeof lost === "string";
}
