// Learning in a worker of its own, which the rig does not wait for: told { on }, it learns or rests, and tells how far it is.

import { Learner } from "./learner.js";

const SEED = 1;
const SAY = 200; // ms between news
const REST = 0.2; // of the time of an update: the rig needs a processor too

const place = (name) => new URL(`../rig/${name}`, import.meta.url);
let on = false;
let busy = false;
let learner = null;
let seconds = 0; // of learning

async function fetched(name) {
  const answer = await fetch(place(name));
  if (!answer.ok) throw new Error(`${name} is missing (${answer.status}); the folder is incomplete`);
  return name.endsWith(".json") ? answer.json() : answer.arrayBuffer();
}

async function load() {
  const [about, code, data] = await Promise.all(["learn.json", "learn.wasm", "learn.bin"].map(fetched));
  learner = new Learner(await WebAssembly.compile(code), about, data, SEED);
  learner.settle();
}

/** Update until told to rest, or all is learned. */
async function learn() {
  if (!learner) await load();
  let said = performance.now();
  let errors = [];
  while (on && learner.share < 1) {
    const begun = performance.now();
    errors.push(learner.update());
    const spent = performance.now() - begun;
    await new Promise((resolve) => setTimeout(resolve, REST * spent));
    seconds += (performance.now() - begun) / 1e3;
    if (begun + spent > said + SAY || learner.share === 1) {
      postMessage({ errors, seconds, share: learner.share, network: learner.learned() });
      [said, errors] = [begun + spent, []];
    }
  }
}

addEventListener("message", async ({ data }) => {
  on = data.on;
  if (busy || !on) return;
  busy = true;
  await learn().catch(({ message }) => postMessage({ failed: message }));
  busy = false;
});
