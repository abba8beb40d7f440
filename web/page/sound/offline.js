// Sound without a clock: the same engine, in the page, as fast as it goes.
import {Engine} from './engine.js';

const kBlock = 4096;
const kSlice = 30;    // ms of work before the page may do something else
const kPrelude = 3;   // s of sound before `from` that ring into it

const breathe = () => new Promise((resolve) => setTimeout(resolve));

/// Renders runs one after another; two calls at a time wait for each other, as they share an engine.
export class Offline {
  #engine = null;
  #run = null;      // that is open,
  #cuts = 0;        // and how often it had been cut then,
  #pieces = 0;      // and how much of it has come
  #line = Promise.resolve();

  constructor(sound, runs, head) {
    this.sound = sound;
    this.runs = runs;
    this.head = head;
  }

  /// Samples in Pa of each channel. `hear` is what the ear is: {format, follow, pose, kinds, ...}.
  render(run, from, seconds, hear) {
    const result = this.#line.then(() => this.#render(run, from, seconds, hear));
    this.#line = result.catch(() => {});
    return result;
  }
  async #render(run, from, seconds, hear) {
    if (!this.sound.renders) throw new Error(`this page has no sound: ${this.sound.reason}`);
    if (!run.hasSound) throw new Error(`the run "${run.label}" has no sound in this page`);
    await this.#open(run);
    const engine = this.#engine;
    engine.hear(hear);
    engine.seek(from, 1, Math.min(from, kPrelude));
    const frames = Math.round(seconds * (run.sampleRate || 48000));
    const channels = Array.from({length: engine.channels}, () => new Float32Array(frames));
    let pause = performance.now() + kSlice;
    for (let done = 0; done < frames; done += kBlock) {
      const count = Math.min(kBlock, frames - done);
      engine.render(count).forEach((plane, channel) => channels[channel].set(plane, done));
      if (performance.now() < pause) continue;
      await breathe();
      pause = performance.now() + kSlice;
    }
    return channels;
  }
  async #open(run) {
    const {growth} = run;
    if (this.#run !== run || this.#cuts !== growth?.cuts) {
      this.#engine ??= new Engine(this.sound.module);
      this.#run = null;
      this.#engine.open(await run.soundBytes(), run.sampleRate || 48000, await this.head());
      if (growth) this.#engine.setOpen();
      [this.#run, this.#cuts, this.#pieces] = [run, growth?.cuts, 0];
    }
    // What has come since, of a run that goes on.
    for (; growth && this.#pieces < growth.pieces.length; ++this.#pieces) this.#engine.append(growth.pieces[this.#pieces].sound);
  }
}
