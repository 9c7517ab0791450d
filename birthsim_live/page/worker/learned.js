// A network that the page has learned becomes the part "policy" of a loop.

import { layersOf } from "../learning/network.js";

const [MEAN, DEVIATION, LAYERS] = [2, 3, 4]; // tables of agents/policy/stage.py; weight and bias of each layer follow

/**
 * `network` has `widths`, `weights` (learning/network.js), and `mean` and `deviation` of what it sees. The part may see more, behind
 * that, which then counts nothing. Null is a network that has learned nothing and says zero.
 */
export function putNetwork(loop, network) {
  const { widths, weights, mean, deviation } = network ?? { widths: [0, 0, 0, 0], weights: [], mean: [], deviation: [] };
  loop.table("policy", MEAN, Float64Array).set(mean);
  loop.table("policy", DEVIATION, Float64Array).fill(1).set(deviation);
  layersOf(widths).forEach(({ inputs, outputs, weight, bias }, k) => {
    const [into, offset] = [0, 1].map((which) => loop.table("policy", LAYERS + 2 * k + which, Float32Array).fill(0));
    for (let j = 0; j < outputs; j += 1) {
      offset[j] = weights[bias + j];
      for (let i = 0; i < inputs; i += 1) into[i * outputs + j] = weights[weight + j * inputs + i];
    }
  });
}
