// The events of a run in order of time, of which more may come, and some may be taken back.

export const kQuietest = 20e-6;  // Pa: the reference of sound pressure levels
export const kEventWidth = 14;

function decibels(pressure) {
  return pressure > 0 ? 20 * Math.log10(pressure / kQuietest) : -Infinity;
}

function eventOf(table, at) {
  return {
    time: table[at], body: table[at + 1], other: table[at + 2], impulse: table[at + 3],
    approachSpeed: table[at + 4], duration: table[at + 5], peak: table[at + 6],
    position: [table[at + 7], table[at + 8], table[at + 9]],
    impulseVector: [table[at + 10], table[at + 11], table[at + 12]],
    kind: table[at + 13],
  };
}

/// Takes a second share of the same collision into `event`: its sound adds to the first's.
function join(event, share, row) {
  event.rows.push(row);
  if (share.peak > event.peak) event.row = row;
  event.peak += share.peak;
}

/// Rows of the table are shares: a collision of two bodies that move has one for each, and is one event.
export class EventList {
  events = [];
  #shares = [];   // {told: its number as they came, event}, in order of time
  #told = 0;

  get told() {
    return this.#told;
  }

  /// Adds the rows of a table. Those that come later may be earlier by a little.
  add(table) {
    const more = [];
    for (let at = 0; at + kEventWidth <= table.length; at += kEventWidth) more.push({told: this.#told++, event: eventOf(table, at)});
    if (!more.length) return;
    const begin = more.reduce((least, {event}) => Math.min(least, event.time), Infinity);
    let first = this.#shares.length;
    while (first > 0 && this.#shares[first - 1].event.time >= begin) --first;
    const tail = this.#shares.splice(first).concat(more).sort((one, other) => one.event.time - other.event.time);
    for (const share of tail) this.#shares.push(share);
    this.#join(first);
  }
  /// Takes back all but the first `told` rows that came.
  keep(told) {
    this.#shares = this.#shares.filter((share) => share.told < told);
    this.#told = told;
    this.#join(0);
  }

  /// Makes events of the shares from one on, which is the first of its time.
  #join(first) {
    const {events} = this;
    const begin = this.#shares[first]?.event.time ?? Infinity;
    while (events.length && (first === 0 || events[events.length - 1].time >= begin)) events.pop();
    const before = events.length;
    let open = [];  // events of the latest time, which may still find their other share
    for (let row = first; row < this.#shares.length; ++row) {
      const share = this.#shares[row].event;
      if (open.length && open[0].time !== share.time) open = [];
      const twin = open.find((event) => event.rows.length === 1 && event.kind === share.kind &&
                                        event.body === share.other && event.other === share.body);
      if (twin) {
        join(twin, share, row);
        continue;
      }
      const event = {...share, row, rows: [row]};
      open.push(event);
      events.push(event);
    }
    for (let index = before; index < events.length; ++index) Object.assign(events[index], {index, level: decibels(events[index].peak)});
  }
}
