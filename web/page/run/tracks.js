// Poses of bodies at any time, between the rows of the table of poses.

export const kPoseWidth = 9;   // time, body, x y z, w x y z
const kWidth = kPoseWidth;

/// The rows of one body in a table, of which the one before a time is found by bisection. It begins at the row of the
/// last call, as time mostly goes on.
export class Track {
  constructor(table, first) {
    Object.assign(this, {table, first, last: first, hint: first});
  }
  get rows() {
    return this.last - this.first + 1;
  }
  #time(row) {
    return this.table[row * kWidth];
  }
  rowBefore(time) {
    const {first, last} = this;
    let low = this.hint;
    if (this.#time(low) > time || (low + 2 <= last && this.#time(low + 2) <= time)) {
      low = first;
      let high = last;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (this.#time(middle) <= time) low = middle; else high = middle;
      }
    } else if (low + 1 <= last && this.#time(low + 1) <= time) {
      ++low;
    }
    this.hint = low;
    return low;
  }
}

/// The tracks of all bodies, in a table that is sorted by body.
export class Tracks {
  tracks = new Map();

  constructor(bodies, table) {
    this.still = new Map(bodies.map((body) => [body.id, body.pose]));
    for (let row = 0; row < Math.floor(table.length / kWidth); ++row) {
      const body = table[row * kWidth + 1], track = this.tracks.get(body);
      if (track) track.last = row; else this.tracks.set(body, new Track(table, row));
    }
  }

  moves(body) {
    return this.tracks.has(body);
  }
  rows(body) {
    return this.tracks.get(body)?.rows ?? 0;
  }

  /// Writes x y z, w x y z of a body at a time to `out`.
  pose(body, time, out) {
    const track = this.tracks.get(body);
    if (!track) {
      const still = this.still.get(body);
      for (let item = 0; item < 7; ++item) out[item] = still[item];
      return out;
    }
    const row = track.rowBefore(time), {table} = track;
    const from = row * kWidth, to = Math.min(row + 1, track.last) * kWidth;
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
