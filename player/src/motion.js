// The motion of the joints: states on rows of times, and cubic curves between them.

const bytes = (text) => Uint8Array.from(atob(text), (character) => character.charCodeAt(0));

/** Return packed columns of `count` numbers each: whole numbers of some bytes, between the extremes of the column. */
export function unpack({ values, width, low, high }, count) {
  const packed = bytes(values);
  const steps = 256 ** width - 1;
  return low.map((least, column) => {
    const step = (high[column] - least) / steps;
    return Float64Array.from({ length: count }, (_, row) => {
      const at = width * (column * count + row);
      let level = 0;
      for (let k = width - 1; k >= 0; k -= 1) level = 256 * level + packed[at + k];
      const value = least + step * level;
      return Math.abs(value) <= step / 2 ? 0 : value; // rest is rest
    });
  });
}

/** The motion on rows of times; where a derivative jumps there are two rows of one time. */
export class Motion {
  /**
   * @param {object} scene With its rows.
   * @param {number} start When it starts, s; without it as its rows say.
   */
  constructor(scene, start) {
    const { rows } = scene;
    this.times = new Float64Array(bytes(rows.times).buffer);
    if (start !== undefined) {
      const shift = start - this.times[0];
      this.times = this.times.map((time) => time + shift);
    }
    this.count = this.times.length;
    this.quantities = Object.keys(rows.quantities);
    this.values = Object.fromEntries(
      this.quantities.map((name) => [name, unpack(rows.quantities[name], this.count)]),
    );
    this.start = this.times[0];
    this.end = this.times[this.count - 1];
  }

  /** Return the row at or before a time; at two rows of one time the later one. */
  rowAt(time) {
    const { times } = this;
    let low = 0;
    let high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** Return the positions of all joints at a time, SI. */
  joints(time) {
    const row = Math.min(this.rowAt(time), Math.max(this.count - 2, 0));
    const length = this.count > 1 ? this.times[row + 1] - this.times[row] : 0;
    const s = length > 0 ? Math.min(Math.max((time - this.times[row]) / length, 0), 1) : 0;
    const { q, qd } = this.values;
    return q.map((column, joint) => {
      const a = column[row];
      const b = column[Math.min(row + 1, this.count - 1)];
      if (!qd || length === 0) return a + s * (b - a);
      const [va, vb] = [qd[joint][row] * length, qd[joint][row + 1] * length];
      const r = 1 - s; // the cubic with these positions and velocities at both ends
      return r * r * (1 + 2 * s) * a + s * s * (1 + 2 * r) * b + r * s * (r * va - s * vb);
    });
  }

  /** Return a quantity of a joint at a time, SI, straight between rows; positions as they are drawn. */
  value(name, joint, time) {
    if (name === 'q') return this.joints(time)[joint];
    return this.between(this.values[name][joint], time);
  }

  /** Return a column at a time, straight between rows. */
  between(column, time) {
    const row = this.rowAt(time);
    const next = Math.min(row + 1, this.count - 1);
    const length = this.times[next] - this.times[row];
    const s = length > 0 ? (time - this.times[row]) / length : 0;
    return column[row] + s * (column[next] - column[row]);
  }
}
