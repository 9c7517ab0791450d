// A network with tanh behind every layer, forward and back over many lanes, and Adam.

const TINY = 1e-8;

/** Where the layers of a network with these `widths` stand in its weights: (out, in) and behind them (out,) of each. */
export function layersOf(widths) {
  let end = 0;
  return widths.slice(1).map((outputs, k) => {
    const weight = end;
    const bias = weight + widths[k] * outputs;
    end = bias + outputs;
    return { inputs: widths[k], outputs, weight, bias, end };
  });
}

export class Network {
  constructor(widths) {
    this.layers = layersOf(widths);
    this.weights = new Float64Array(this.layers.at(-1).end);
    this.gradient = new Float64Array(this.weights.length);
  }

  /** As PyTorch begins, but for a last layer of zeros; `random()` is between 0 and 1. */
  begin(random) {
    for (const { inputs, weight, end } of this.layers.slice(0, -1)) {
      for (let k = weight; k < end; k += 1) this.weights[k] = (2 * random() - 1) / Math.sqrt(inputs);
    }
  }

  /** Activations of all layers, the inputs (lanes, D) first; the last ones are the outputs. */
  forward(inputs, lanes) {
    const passed = [inputs];
    for (const layer of this.layers) passed.push(this.through(layer, passed.at(-1), lanes));
    return passed;
  }

  through({ inputs, outputs, weight, bias }, x, lanes) {
    const { weights } = this;
    const y = new Float64Array(lanes * outputs);
    for (let lane = 0; lane < lanes; lane += 1) {
      const from = lane * inputs;
      for (let j = 0; j < outputs; j += 1) {
        const row = weight + j * inputs;
        let sum = weights[bias + j];
        for (let i = 0; i < inputs; i += 1) sum += weights[row + i] * x[from + i];
        y[lane * outputs + j] = Math.tanh(sum);
      }
    }
    return y;
  }

  /** Add to the gradient of the weights what gradients to the outputs of `passed` make of it; returns those to the inputs. */
  back(passed, outputs, lanes) {
    return this.layers.reduceRight((bars, layer, k) => this.backThrough(layer, passed[k], passed[k + 1], bars, lanes), outputs);
  }

  backThrough({ inputs, outputs, weight, bias }, x, y, bars, lanes) {
    const { weights, gradient } = this;
    const found = new Float64Array(lanes * inputs);
    for (let lane = 0; lane < lanes; lane += 1) {
      const from = lane * inputs;
      for (let j = 0; j < outputs; j += 1) {
        const [row, at] = [weight + j * inputs, lane * outputs + j];
        const bar = bars[at] * (1 - y[at] * y[at]);
        gradient[bias + j] += bar;
        for (let i = 0; i < inputs; i += 1) {
          gradient[row + i] += bar * x[from + i];
          found[from + i] += bar * weights[row + i];
        }
      }
    }
    return found;
  }
}

/** Climbs down along gradients made one long: one bad horizon moves no more than another. */
export class Adam {
  constructor(network, [first, second]) {
    Object.assign(this, { network, first, second, steps: 0 });
    this.mean = new Float64Array(network.weights.length);
    this.square = new Float64Array(network.weights.length);
  }

  /** Take the gradient; one that is not finite teaches nothing. */
  step(rate) {
    const { weights, gradient } = this.network;
    const size = Math.sqrt(gradient.reduce((sum, value) => sum + value * value, 0));
    if (!(size > 0 && Number.isFinite(size))) return;
    this.steps += 1;
    const [left, leftSquare] = [1 - this.first ** this.steps, 1 - this.second ** this.steps];
    for (let k = 0; k < weights.length; k += 1) {
      const slope = gradient[k] / size;
      this.mean[k] += (1 - this.first) * (slope - this.mean[k]);
      this.square[k] += (1 - this.second) * (slope * slope - this.square[k]);
      weights[k] -= (rate / left) * this.mean[k] / (Math.sqrt(this.square[k] / leftSquare) + TINY);
    }
  }
}
