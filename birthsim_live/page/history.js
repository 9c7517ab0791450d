// The last seconds of named series in typed arrays that never move more than once in a while.

const LEAP = 1; // s

export class History {
  constructor(names, capacity, gap) {
    this.capacity = capacity;
    this.gap = gap; // s; frames nearer than this are left out: a plot has no room for them
    this.columns = Object.fromEntries(["time", ...names].map((name) => [name, new Float64Array(2 * capacity)]));
    this.clear();
  }

  clear() {
    this.start = 0;
    this.end = 0;
    this.newest = -Infinity;
  }

  /** Add one row. A time that runs back, by a reset or a search, takes away what came after it; a leap forward begins anew. */
  push(time, row) {
    if (time < this.newest) this.cut(time);
    if (time - this.newest > LEAP) this.clear();
    if (time - this.newest < this.gap) return;
    if (this.end === 2 * this.capacity) this.slide();
    this.columns.time[this.end] = time;
    for (const name in row) this.columns[name][this.end] = row[name];
    this.end += 1;
    this.start = Math.max(this.start, this.end - this.capacity);
    this.newest = time;
  }

  cut(time) {
    while (this.end > this.start && this.columns.time[this.end - 1] >= time) this.end -= 1;
    this.newest = this.end > this.start ? this.columns.time[this.end - 1] : -Infinity;
  }

  /** Twice the room that is needed: copying happens once per `capacity` rows. */
  slide() {
    for (const column of Object.values(this.columns)) column.copyWithin(0, this.start, this.end);
    this.end -= this.start;
    this.start = 0;
  }

  /** The newest value of a series at a time; NaN before the first. */
  at(name, time) {
    return this.view(name)[this.view("time").findLastIndex((one) => one <= time)] ?? NaN;
  }

  /** The kept values of one series, without a copy. */
  view(name) {
    return this.columns[name].subarray(this.start, this.end);
  }
}
