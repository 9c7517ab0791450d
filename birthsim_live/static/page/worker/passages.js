// Smooth passages (birthsim_live/rig/bridge.py): of the target, and of setpoints and forces that would jump.

/** An offset, four pairs (value and three derivatives), that comes to rest at zero: a polynomial of degree 7. */
export class Bridge {
  constructor(begins, lasts, offset) {
    this.begins = begins;
    this.lasts = lasts;
    this.coefficients = [0, 1].map((axis) => {
      const [a, b, c, d] = [0, 1, 2, 3].map((order) => (offset[2 * order + axis] * lasts ** order) / [1, 1, 2, 6][order]);
      // Coefficients 4 to 7 make value and three derivatives zero at the end.
      const [value, slope, bend, jerk] = [-(a + b + c + d), -(b + 2 * c + 3 * d), -(2 * c + 6 * d), -6 * d];
      return [
        ...[a, b, c, d],
        35 * value - 15 * slope + 2.5 * bend - jerk / 6,
        -84 * value + 39 * slope - 7 * bend + jerk / 2,
        70 * value - 34 * slope + 6.5 * bend - jerk / 2,
        -20 * value + 10 * slope - 2 * bend + jerk / 6,
      ];
    });
  }

  /** The offset and three derivatives, x and y of each. */
  sample(time) {
    const u = Math.max((time - this.begins) / this.lasts, 0);
    const rows = new Array(8).fill(0);
    if (u >= 1) return rows;
    this.coefficients.forEach((own, axis) => {
      let coefficients = own;
      for (let order = 0; order < 4; order += 1) {
        const value = coefficients.reduceRight((sum, c) => c + u * sum, 0);
        rows[2 * order + axis] = value / this.lasts ** order;
        coefficients = coefficients.slice(1).map((c, k) => c * (k + 1));
      }
    });
    return rows;
  }
}

/** An offset that fades to zero at minimum jerk. */
export class Fade {
  constructor(begins, lasts, offset) {
    Object.assign(this, { begins, lasts, offset });
  }

  /** The offset left, and its rate. */
  sample(time) {
    const u = Math.min(Math.max((time - this.begins) / this.lasts, 0), 1);
    const passed = u * u * u * (10 + u * (6 * u - 15));
    const rate = 30 * u * u * (1 - u) * (1 - u);
    return [this.offset.map((value) => value * (1 - passed)), this.offset.map((value) => (-value * rate) / this.lasts)];
  }

  over(time) {
    return time >= this.begins + this.lasts;
  }
}
