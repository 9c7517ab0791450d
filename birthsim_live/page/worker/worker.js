// The rig in a worker: it loads what was built, says hello, and takes the page's messages from then on.

import { load } from "../rig/birthsim.js";
import { Hub } from "./hub.js";

const place = (name) => new URL(`../rig/${name}`, import.meta.url);

async function fetched(name) {
  const answer = await fetch(place(name));
  if (!answer.ok) throw new Error(`${name} is missing (${answer.status}); the folder is incomplete`);
  return name.endsWith(".json") ? answer.json() : answer.arrayBuffer();
}

async function begin() {
  const [pack, code, data] = await Promise.all(["pack.json", "loop.wasm", "loop.bin"].map(fetched));
  return new Hub(pack, await load({ code, data }), (message) => postMessage(message));
}

const hub = begin();
// What comes while the rig is loading waits for it, in order.
addEventListener("message", async ({ data }) => (await hub).receive(data));
hub.then((running) => running.start()).catch((error) => postMessage({ type: "failed", message: error.message }));
