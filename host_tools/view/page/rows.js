// The rows of one axis that were heard last, in rings of one length.

/** `least`: the narrowest span that is worth a picture, in the unit that is shown. */
export const SIGNALS = {
  position: { unit: "m", least: 0.2 },
  velocity: { unit: "m/s", least: 10 },
  force: { unit: "N", least: 0.5 },
  current: { unit: "A", least: 0.2 },
};
const LENGTH = 8192;

export class Rows {
  constructor(tickRate) {
    this.tickRate = tickRate;
    this.tick = new Float64Array(LENGTH);
    this.flags = new Uint16Array(LENGTH);
    for (const name of Object.keys(SIGNALS)) this[name] = new Float64Array(LENGTH);
    this.count = 0;
  }

  /** Ticks, and the lists of one axis, of a message "rows". */
  take(ticks, axis) {
    // A device that has restarted counts from the beginning.
    if (this.count && ticks[0] <= this.tick[this.at(0)]) this.count = 0;
    for (let i = 0; i < ticks.length; ++i) {
      const place = this.count % LENGTH;
      this.tick[place] = ticks[i];
      this.flags[place] = axis.flags[i];
      for (const name of Object.keys(SIGNALS)) this[name][place] = axis[name][i];
      ++this.count;
    }
  }

  get length() { return Math.min(this.count, LENGTH); }
  /** Place of the row that came `back` rows before the last one. */
  at(back) { return (this.count - 1 - back + LENGTH) % LENGTH; }

  /** How many rows the last `seconds` have. */
  within(seconds) {
    if (!this.length) return 0;
    const from = this.tick[this.at(0)] - seconds * this.tickRate;
    let n = 0;
    while (n < this.length && this.tick[this.at(n)] >= from) ++n;
    return n;
  }

  /** The last `n` values of a signal, oldest first. */
  last(name, n) {
    const values = new Float64Array(n);
    for (let i = 0; i < n; ++i) values[i] = this[name][this.at(n - 1 - i)];
    return values;
  }

  /** s between rows, as the last ones came. */
  get period() {
    const n = Math.min(this.length, 200);
    return n < 2 ? NaN : (this.tick[this.at(0)] - this.tick[this.at(n - 1)]) / (n - 1) / this.tickRate;
  }
}
