// The time line: a mark for every collision by its loudness, lasting contacts as bars, and the scale of time.
import {sidesOf} from '../run/data.js';
import {markColour} from '../stage/colours.js';

const kRange = 66;        // dB from the loudest mark to none
const kTop = 18, kLanes = 2, kLane = 4, kGap = 2;
const kNear = 9;          // pixels from a mark that still take it

function tickStep(span, width) {
  const least = span * 84 / width, power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= least);
}
function tickText(time, step) {
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return digits > 3 ? `${(time * 1000).toFixed(Math.max(0, digits - 3))} ms` : `${time.toFixed(digits)} s`;
}

export class Timeline {
  constructor(canvas, window, ear) {
    Object.assign(this, {canvas, window, ear});
    this.pen = canvas.getContext('2d');
  }

  show(run, looks) {
    this.run = run;
    this.looks = looks;
    this.measure();
    this.paint(this.theme);
  }
  /// Looks for the loudest event and places the bars; again when the run has gone on.
  measure() {
    const {run} = this;
    this.loudest = run.events.reduce((most, event) => Math.max(most, event.level), -Infinity);
    const ends = [0, 0];
    this.bars = run.contacts.map((contact) => {
      const lane = ends[0] <= contact.begin ? 0 : ends[1] <= ends[0] ? 1 : 0;
      ends[lane] = Math.max(ends[lane], contact.end);
      return {...contact, lane};
    });
  }
  paint(theme) {
    this.theme = theme;
    if (!theme || !this.run) return;
    this.colours = new Map([...this.looks].map(([id, {lch}]) => [id, markColour(lch, theme.dark)]));
    this.draw();
  }
  resize(width, height) {
    const scale = Math.min(2, devicePixelRatio);
    Object.assign(this, {width, height});
    this.canvas.width = Math.round(width * scale);
    this.canvas.height = Math.round(height * scale);
    this.pen.setTransform(scale, 0, 0, scale, 0, 0);
    this.draw();
  }

  x(time) {
    return (time - this.window.begin) / this.window.span * this.width;
  }
  time(x) {
    return this.window.begin + x / this.width * this.window.span;
  }
  get floor() {
    return this.height - (this.bars?.length ? kLanes * (kLane + kGap) + 2 : 1);
  }
  #tall(level) {
    return Math.max(2, Math.max(0, 1 + (level - this.loudest) / kRange) * (this.floor - kTop - 4));
  }
  /// The colour of a mark is that of the body that moves.
  #colourOf(event) {
    return this.colours.get(sidesOf(this.run, event)[0]) ?? this.theme.soft;
  }

  draw() {
    if (!this.theme || !this.run || !this.width) return;
    this.pen.clearRect(0, 0, this.width, this.height);
    this.#drawScale();
    this.#drawBars();
    this.#drawMarks();
  }
  #drawScale() {
    const {pen, theme, window} = this, step = tickStep(window.span, this.width);
    pen.font = '11px system-ui, sans-serif';
    pen.fillStyle = theme.soft;
    pen.strokeStyle = theme.line;
    pen.lineWidth = 1;
    pen.beginPath();
    for (let tick = Math.ceil(window.begin / step); tick * step <= window.end; ++tick) {
      const x = Math.round(this.x(tick * step)) + 0.5;
      pen.moveTo(x, kTop);
      pen.lineTo(x, this.floor);
      const text = tickText(tick * step, step);
      const wide = pen.measureText(text).width;
      pen.fillText(text, Math.min(this.width - wide - 2, Math.max(1, x - wide / 2)), 11);
    }
    pen.moveTo(0, this.floor + 0.5);
    pen.lineTo(this.width, this.floor + 0.5);
    pen.stroke();
  }
  #drawBars() {
    for (const bar of this.bars) {
      const from = Math.max(0, this.x(bar.begin)), to = Math.min(this.width, this.x(bar.end));
      if (to < 0 || from > this.width) continue;
      this.pen.globalAlpha = bar.slides ? 0.95 : 0.45;
      this.pen.fillStyle = this.#colourOf(bar);
      this.pen.fillRect(from, this.floor + 3 + bar.lane * (kLane + kGap), Math.max(1.5, to - from), kLane);
    }
    this.pen.globalAlpha = 1;
  }

  /// Index of the first event not before a time.
  first(time) {
    const {events} = this.run;
    let low = 0, high = events.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (events[middle].time < time) low = middle + 1; else high = middle;
    }
    return low;
  }
  /// The loudest event of each column of pixels, heard ones before those that are not.
  #columns() {
    const columns = new Array(Math.ceil(this.width)).fill(null);
    const {events} = this.run;
    let count = 0;
    for (let index = this.first(this.window.begin); index < events.length && events[index].time <= this.window.end; ++index) {
      const event = events[index], column = Math.min(columns.length - 1, Math.floor(this.x(event.time)));
      const best = columns[column];
      ++count;
      if (!best || (this.ear.hears(event) && !this.ear.hears(best)) || event.level > best.level) columns[column] = event;
    }
    return {columns, count};
  }
  #drawMarks() {
    const {pen} = this, {columns, count} = this.#columns();
    const sparse = count < this.width / 7, wide = sparse ? 2 : 1.25;
    for (const event of columns) {
      if (!event) continue;
      const x = this.x(event.time), tall = this.#tall(event.level);
      pen.globalAlpha = this.ear.hears(event) ? 1 : 0.2;
      pen.fillStyle = this.#colourOf(event);
      pen.fillRect(x - wide / 2, this.floor - tall, wide, tall);
      if (sparse) this.#dot(x, this.floor - tall, 3);
    }
    pen.globalAlpha = 1;
    this.#drawSelected();
  }
  #dot(x, y, radius) {
    this.pen.beginPath();
    this.pen.arc(x, y, radius, 0, 2 * Math.PI);
    this.pen.fill();
  }
  #drawSelected() {
    const event = this.selected;
    if (!event || event.time < this.window.begin || event.time > this.window.end) return;
    const {pen} = this, x = this.x(event.time), y = this.floor - this.#tall(event.level);
    pen.fillStyle = this.theme.accent;
    pen.fillRect(x - 1.25, y, 2.5, this.floor - y);
    this.#dot(x, y, 4.5);
    pen.strokeStyle = this.theme.paper;
    pen.lineWidth = 1.5;
    pen.stroke();
  }

  /// The mark near a place, the louder of equals; null if there is none.
  at(x, y) {
    const {events} = this.run;
    let best = null, least = Infinity;
    for (let index = this.first(this.time(x - kNear)); index < events.length && this.x(events[index].time) <= x + kNear; ++index) {
      const event = events[index], above = Math.max(0, this.floor - this.#tall(event.level) - y - 6);
      const far = Math.abs(this.x(event.time) - x) + 0.6 * above - 0.06 * (event.level - this.loudest + kRange);
      if (far < least) [best, least] = [event, far];
    }
    return best;
  }
}
