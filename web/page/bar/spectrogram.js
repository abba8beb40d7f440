// What has been heard, over the simulation's time: frequency upwards, on a scale of octaves, loudness as colour.
import {Fourier} from './fourier.js';
import {kQuietest} from '../run/events.js';

const kSize = 1024, kHop = 128;
const kRows = 88;
const kLow = 60, kHigh = 20000;   // Hz
const kRange = 66;                // dB
const kKept = 48000;              // columns: two minutes of listening

/// Row by row, the bins whose greatest amplitude it shows.
function rowsOf(sampleRate) {
  return Array.from({length: kRows}, (none, row) => {
    const from = kLow * (kHigh / kLow) ** (row / kRows), to = kLow * (kHigh / kLow) ** ((row + 1) / kRows);
    const first = Math.min(kSize / 2 - 1, Math.round(from * kSize / sampleRate));
    return [first, Math.min(kSize / 2, Math.max(first + 1, Math.round(to * kSize / sampleRate)))];
  });
}

export class Spectrogram {
  #fourier = new Fourier(kSize);
  #amplitudes = new Float64Array(kSize / 2);
  #samples = new Float32Array(kSize);
  #columns = [];           // {begin, end, levels: Uint8Array of dB above -20}, in the order heard
  #drawn = 0;
  #last = null;
  loudest = 20;

  constructor(canvas, window) {
    this.canvas = canvas;
    this.window = window;
    this.pen = canvas.getContext('2d');
    this.buffer = document.createElement('canvas');
    this.bufferPen = this.buffer.getContext('2d');
  }

  /// Samples of one report of the worklet, in Pa, from `begin` to `end` of the simulation.
  hear({begin, end, samples, id}, sampleRate) {
    if (!samples.length || end <= begin) return;
    this.rows ??= rowsOf(sampleRate);
    if (id !== this.#last?.id || Math.abs(begin - this.#last.end) > 1e-9) this.#samples.fill(0);
    this.#last = {id, end};
    const rate = (end - begin) / samples.length;
    for (let at = 0; at + kHop <= samples.length; at += kHop) {
      this.#samples.copyWithin(0, kHop);
      this.#samples.set(samples.subarray(at, at + kHop), kSize - kHop);
      // The window's middle lies half of its length before the newest sample.
      const middle = begin + rate * (at + kHop - kSize / 2);
      this.#add(middle - rate * kHop / 2, middle + rate * kHop / 2);
    }
    if (this.#columns.length > kKept) {
      this.#columns.splice(0, kKept / 4);
      this.#drawn = Math.max(0, this.#drawn - kKept / 4);
    }
  }
  #add(begin, end) {
    this.#fourier.amplitudes(this.#samples, this.#amplitudes);
    const levels = new Uint8Array(kRows);
    this.rows.forEach(([first, last], row) => {
      let most = 0;
      for (let bin = first; bin < last; ++bin) most = Math.max(most, this.#amplitudes[bin]);
      const level = 20 * Math.log10(most / kQuietest + 1e-9);
      levels[row] = Math.min(255, Math.max(0, 1.3 * (level + 40)));
      if (level > this.loudest + 0.5) {
        this.loudest = level;
        this.#drawn = 0;
      }
    });
    this.#columns.push({begin, end, levels});
  }
  /// Forgets what was heard of all after a time (s).
  forget(after = -Infinity) {
    this.#columns = this.#columns.filter((column) => column.end <= after);
    this.redraw();
  }
  get empty() {
    return this.#columns.length === 0;
  }

  resize(width, height) {
    Object.assign(this, {width, height});
    const scale = Math.min(2, devicePixelRatio);
    this.canvas.width = Math.round(width * scale);
    this.canvas.height = Math.round(height * scale);
    this.buffer.width = Math.max(1, Math.round(width));
    this.buffer.height = kRows;
    this.redraw();
  }
  paint(theme) {
    this.ramp = theme.ramp;
    this.redraw();
  }
  redraw() {
    this.#drawn = 0;
    this.stale = true;
  }

  /// Draws what came since the last call; everything, if the window or the scale has changed.
  draw() {
    if (!this.ramp || !this.width || (!this.stale && this.#drawn === this.#columns.length)) return;
    if (this.#drawn === 0) this.bufferPen.clearRect(0, 0, this.buffer.width, kRows);
    const {begin, span} = this.window, wide = this.buffer.width;
    for (; this.#drawn < this.#columns.length; ++this.#drawn) {
      const column = this.#columns[this.#drawn];
      const from = Math.round((column.begin - begin) / span * wide);
      const to = Math.max(from + 1, Math.round((column.end - begin) / span * wide));
      if (to > 0 && from < wide) this.#drawColumn(column.levels, Math.max(0, from), Math.min(wide, to) - Math.max(0, from));
    }
    this.stale = false;
    this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.pen.imageSmoothingEnabled = true;
    this.pen.drawImage(this.buffer, 0, 0, this.canvas.width, this.canvas.height);
  }
  #drawColumn(levels, x, width) {
    const picture = this.bufferPen.createImageData(width, kRows);
    const quiet = this.loudest - kRange;
    for (let row = 0; row < kRows; ++row) {
      const part = (levels[row] / 1.3 - 40 - quiet) / kRange;
      const colour = this.ramp[Math.min(255, Math.max(0, Math.round(255 * part)))];
      for (let column = 0; column < width; ++column) {
        picture.data.set(colour, 4 * ((kRows - 1 - row) * width + column));
      }
    }
    this.bufferPen.putImageData(picture, x, 0);
  }
}
