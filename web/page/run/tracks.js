// Poses of bodies at any time, between the rows of the table of poses.

export const kPoseWidth = 9;   // time, body, x y z, w x y z
const kWidth = kPoseWidth;

/// Rows of one body are found once; within them the row before a time by bisection, which begins
/// at the row of the last call, as time mostly goes on.
export class Tracks {
  constructor(bodies, table) {
    this.table = table;
    this.first = new Map();
    this.last = new Map();
    this.hint = new Map();
    this.still = new Map(bodies.map((body) => [body.id, body.pose]));
    for (let row = 0; row < Math.floor(table.length / kWidth); ++row) {
      const body = this.table[row * kWidth + 1];
      if (!this.first.has(body)) this.first.set(body, row);
      this.last.set(body, row);
    }
  }

  moves(body) {
    return this.first.has(body);
  }
  rows(body) {
    return this.first.has(body) ? this.last.get(body) - this.first.get(body) + 1 : 0;
  }

  #rowBefore(body, time) {
    const first = this.first.get(body), last = this.last.get(body);
    const timeOf = (row) => this.table[row * kWidth];
    let low = this.hint.get(body) ?? first;
    if (timeOf(low) > time || (low + 2 <= last && timeOf(low + 2) <= time)) {
      low = first;
      let high = last;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (timeOf(middle) <= time) low = middle; else high = middle;
      }
    } else if (low + 1 <= last && timeOf(low + 1) <= time) {
      ++low;
    }
    this.hint.set(body, low);
    return low;
  }

  /// Writes x y z, w x y z of a body at a time to `out`.
  pose(body, time, out) {
    if (!this.first.has(body)) {
      const still = this.still.get(body);
      for (let item = 0; item < 7; ++item) out[item] = still[item];
      return out;
    }
    const row = this.#rowBefore(body, time);
    const next = Math.min(row + 1, this.last.get(body));
    const from = row * kWidth, to = next * kWidth, table = this.table;
    const span = table[to] - table[from];
    const part = span > 0 ? Math.min(1, Math.max(0, (time - table[from]) / span)) : 0;
    for (let item = 0; item < 3; ++item) out[item] = table[from + 2 + item] + part * (table[to + 2 + item] - table[from + 2 + item]);
    turn(table, from + 5, to + 5, part, out);
    return out;
  }
}

/// Spherical interpolation of two quaternions of a table, by the shorter way.
function turn(table, from, to, part, out) {
  let dot = 0;
  for (let item = 0; item < 4; ++item) dot += table[from + item] * table[to + item];
  const sign = dot < 0 ? -1 : 1;
  dot = Math.min(1, Math.abs(dot));
  let weightFrom = 1 - part, weightTo = part;
  if (dot < 0.9995) {
    const angle = Math.acos(dot), sine = Math.sin(angle);
    weightFrom = Math.sin((1 - part) * angle) / sine;
    weightTo = Math.sin(part * angle) / sine;
  }
  let square = 0;
  for (let item = 0; item < 4; ++item) {
    out[3 + item] = weightFrom * table[from + item] + sign * weightTo * table[to + item];
    square += out[3 + item] * out[3 + item];
  }
  const scale = 1 / Math.sqrt(square || 1);
  for (let item = 0; item < 4; ++item) out[3 + item] *= scale;
}
