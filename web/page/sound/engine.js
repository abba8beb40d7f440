// An instance of carom.wasm with one run open. The page has one for offline renders, the worklet one for live sound;
// worklets have neither TextDecoder nor performance, so this file uses neither.
import {exportsOf, Instance} from './instance.js';

export const kFormats = ['mono', 'pair', 'head'];

/// True if the module can play runs; older ones have only the C API.
export function playsRuns(module) {
  return exportsOf(module, 'carom_run_open');
}

/// Every function that refuses throws an Error with the engine's own sentence.
export class Engine extends Instance {
  #frames = 0;
  #planes = 0;
  #audible = new Map();

  constructor(module) {
    super(module);
    this.run = 0;
    this.pose = this.carom.malloc(56) >>> 0;
  }

  #poseAt(pose) {
    new Float64Array(this.carom.memory.buffer, this.pose, 7).set(pose);
    return this.pose;
  }

  open(bytes, sampleRate, head) {
    this.close();
    this.run = this.with(bytes, (at, size) => this.carom.carom_run_open(at, size, sampleRate)) >>> 0;
    if (!this.run) throw new Error(this.message());
    if (head) this.check(this.with(head, (at, size) => this.carom.carom_run_set_head(this.run, at, size)));
    this.#audible.clear();
  }
  /// Has the run go on: portions are still to come.
  setOpen() {
    this.carom.carom_run_set_open(this.run, 1);
  }
  /// Adds what has come to a run that goes on.
  append(bytes) {
    this.check(this.with(bytes, (at, size) => this.carom.carom_run_append(this.run, at, size)));
  }
  /// Takes back all portions from one on; a seek is needed then.
  cut(portions) {
    this.carom.carom_run_cut(this.run, portions);
  }
  close() {
    if (this.run) this.carom.carom_run_close(this.run);
    this.run = 0;
  }

  /// What is heard from the next seek on: {format, follow, pose, kinds, only, silent: a Set of bodies}.
  hear({format = 'mono', follow = -1, pose, kinds = 7, only = -1, silent = null}) {
    if (follow < 0) this.check(this.carom.carom_run_set_format(this.run, Math.max(0, kFormats.indexOf(format))));
    this.check(this.carom.carom_run_follow(this.run, follow));
    if (pose) this.check(this.carom.carom_run_place_ear(this.run, this.#poseAt(pose)));
    this.carom.carom_run_set_kinds(this.run, kinds);
    this.carom.carom_run_set_only(this.run, only);
    for (const body of this.#audible.keys()) {
      if (!silent?.has(body)) this.#setAudible(body, true);
    }
    for (const body of silent ?? []) this.#setAudible(body, false);
  }
  #setAudible(body, yes) {
    if ((this.#audible.get(body) ?? true) === yes) return;
    this.#audible.set(body, yes);
    this.carom.carom_run_set_audible(this.run, body, yes ? 1 : 0);
  }

  moveEar(pose) {
    this.check(this.carom.carom_run_set_ear(this.run, this.#poseAt(pose)));
  }
  seek(time, speed, prelude) {
    this.check(this.carom.carom_run_seek(this.run, time, speed, prelude));
    this.channels = this.carom.carom_run_channels(this.run) >>> 0;
  }

  /// Renders the next frames: an array of views, one for each channel, which end with the next call.
  render(frames) {
    const wanted = frames * this.channels;
    if (wanted > this.#frames) {
      if (this.#planes) this.carom.free(this.#planes);
      this.#planes = this.carom.malloc(4 * wanted) >>> 0;
      this.#frames = wanted;
    }
    this.check(this.carom.carom_run_render(this.run, this.#planes, frames));
    return Array.from({length: this.channels}, (none, channel) =>
        new Float32Array(this.carom.memory.buffer, this.#planes + 4 * channel * frames, frames));
  }

  get duration() {
    return this.carom.carom_run_duration(this.run);
  }
  get time() {
    return this.carom.carom_run_time(this.run);
  }
  /// Time (s) of the run before which all is known.
  get known() {
    return this.carom.carom_run_known(this.run);
  }
  get late() {
    return this.carom.carom_run_late(this.run) >>> 0;
  }
}
