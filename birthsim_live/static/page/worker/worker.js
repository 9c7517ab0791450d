// The rig in a worker: it loads what was built, says hello, and takes the page's messages from then on.

import { Hub } from "./hub.js";
import { Machine } from "./machine.js";

const place = (name) => new URL(`../../rig/${name}`, import.meta.url);

async function fetched(name) {
  const answer = await fetch(place(name));
  if (!answer.ok) throw new Error(`${name} is missing (${answer.status}); the folder is incomplete`);
  return answer;
}

async function begin() {
  const [pack, code] = await Promise.all([
    fetched("pack.json").then((answer) => answer.json()),
    fetched("loop.wasm").then((answer) => answer.arrayBuffer()),
  ]);
  const machine = await Machine.of(code, pack.block);
  const network = (file) => fetched(file).then((answer) => answer.arrayBuffer());
  return new Hub(pack, machine, network, (message) => postMessage(message));
}

const hub = begin();
// What comes while the rig is loading waits for it, in order.
addEventListener("message", async ({ data }) => (await hub).receive(data));
hub.then((running) => running.start()).catch((error) => postMessage({ type: "failed", message: error.message }));
