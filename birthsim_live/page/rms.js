// Root mean square of a quantity over the last seconds.

export const SPAN = 2; // s
const LEAP = 0.5; // s; a gap in time begins anew

export class RunningRms {
  constructor() {
    this.clear();
  }

  clear() {
    this.values = []; // { time, square }, oldest first
    this.value = NaN;
  }

  /** Add a value and return the root mean square; each value counts with the time since the one before. */
  push(time, value) {
    const newest = this.values.at(-1)?.time ?? time;
    if (time < newest || time > newest + LEAP) this.clear();
    if (Number.isFinite(value) && !(time === newest && this.values.length)) {
      this.values.push({ time, square: value * value });
      while (this.values[0].time < time - SPAN) this.values.shift();
      this.value = this.mean();
    }
    return this.value;
  }

  mean() {
    const { values } = this;
    if (values.length === 1) return Math.sqrt(values[0].square);
    let sum = 0;
    for (let k = 1; k < values.length; k += 1) sum += values[k].square * (values[k].time - values[k - 1].time);
    return Math.sqrt(sum / (values.at(-1).time - values[0].time));
  }
}
