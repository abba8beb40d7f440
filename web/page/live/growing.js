// Tables that grow: numbers in one array that is made twice as long when it is full.
import {kPoseWidth, Track, Tracks} from '../run/tracks.js';

export class Growing {
  count = 0;
  constructor(Type, least = 64) {
    this.data = new Type(least);
  }
  add(numbers) {
    if (this.count + numbers.length > this.data.length) {
      const more = new this.data.constructor(2 * (this.count + numbers.length));
      more.set(this.data.subarray(0, this.count));
      this.data = more;
    }
    this.data.set(numbers, this.count);
    this.count += numbers.length;
  }
  keep(count) {
    this.count = Math.min(count, this.count);
  }
  get numbers() {
    return this.data.subarray(0, this.count);
  }
}

/// Tracks of bodies whose poses come in order of time.
export class GrowingTracks extends Tracks {
  #tables = new Map();

  constructor(bodies) {
    super(bodies, new Float32Array(0));
    this.movers = new Set(bodies.filter((body) => body.moves).map((body) => body.id));
  }
  /// A body is taken to move although it has not yet.
  moves(body) {
    return this.movers.has(body);
  }
  addBodies(bodies) {
    for (const body of bodies) {
      this.still.set(body.id, body.pose);
      if (body.moves) this.movers.add(body.id);
    }
  }

  add(table) {
    for (let at = 0; at + kPoseWidth <= table.length; at += kPoseWidth) this.#addRow(table.subarray(at, at + kPoseWidth));
  }
  #addRow(row) {
    const body = row[1];
    if (!this.#tables.has(body)) this.#tables.set(body, new Growing(Float32Array, 64 * kPoseWidth));
    const grown = this.#tables.get(body), track = this.tracks.get(body);
    grown.add(row);
    if (track) Object.assign(track, {table: grown.data, last: track.last + 1});
    else this.tracks.set(body, new Track(grown.data, 0));
  }

  /// Takes back all poses after a time (s), and bodies that are not there any more.
  keep(time, bodies) {
    for (const [body, grown] of this.#tables) {
      let rows = grown.count / kPoseWidth;
      // A pose of that very time may have been rounded up.
      while (rows > 0 && grown.data[(rows - 1) * kPoseWidth] > Math.fround(time)) --rows;
      grown.keep(rows * kPoseWidth);
      const track = this.tracks.get(body);
      if (rows > 0 && bodies.has(body)) {
        Object.assign(track, {last: rows - 1, hint: Math.min(track.hint, rows - 1)});
        continue;
      }
      this.#tables.delete(body);
      this.tracks.delete(body);
    }
    for (const body of this.movers) if (!bodies.has(body)) this.movers.delete(body);
  }
}
