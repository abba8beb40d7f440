// An instance of carom.wasm with one run open. The page has one for offline renders, the worklet one for live sound;
// worklets have neither TextDecoder nor performance, so this file uses neither.

export const kFormats = ['mono', 'pair', 'head'];
const kBadDescriptor = 8;  // errno of WASI

function wasi(memory) {
  const view = () => new DataView(memory().buffer);
  const start = Date.now();
  return {
    clock_time_get(clock, precision, at) {
      view().setBigUint64(at, BigInt(Date.now() - start) * 1000000n, true);
      return 0;
    },
    environ_sizes_get(count, size) {
      view().setUint32(count, 0, true);
      view().setUint32(size, 0, true);
      return 0;
    },
    environ_get: () => 0,
    // Messages are read from carom_last_message.
    fd_write: () => kBadDescriptor,
    fd_close: () => kBadDescriptor,
    fd_seek: () => kBadDescriptor,
    proc_exit() {
      throw new Error('the engine has ended');
    },
  };
}

/// True if the module can play runs; older ones have only the C API.
export function playsRuns(module) {
  return WebAssembly.Module.exports(module).some(({name}) => name === 'carom_run_open');
}

/// Every function that refuses throws an Error with the engine's own sentence.
export class Engine {
  #frames = 0;
  #planes = 0;
  #audible = new Map();

  constructor(module) {
    this.carom = new WebAssembly.Instance(module, {wasi_snapshot_preview1: wasi(() => this.carom.memory)}).exports;
    this.carom._initialize();
    this.run = 0;
    this.pose = this.carom.malloc(56) >>> 0;
  }

  #message() {
    const at = this.carom.carom_last_message() >>> 0;
    const bytes = new Uint8Array(this.carom.memory.buffer);
    let text = '';
    for (let byte = at; at && bytes[byte]; ++byte) text += String.fromCharCode(bytes[byte]);
    return text || 'the engine refuses, and does not say why';
  }
  #check(status) {
    if (status !== 0) throw new Error(this.#message());
  }
  #copy(bytes) {
    const at = this.carom.malloc(Math.max(1, bytes.length)) >>> 0;
    if (!at) throw new Error('there is no memory left');
    new Uint8Array(this.carom.memory.buffer).set(bytes, at);
    return at;
  }
  #poseAt(pose) {
    new Float64Array(this.carom.memory.buffer, this.pose, 7).set(pose);
    return this.pose;
  }

  open(bytes, sampleRate, head) {
    this.close();
    const at = this.#copy(bytes);
    this.run = this.carom.carom_run_open(at, bytes.length, sampleRate) >>> 0;
    this.carom.free(at);
    if (!this.run) throw new Error(this.#message());
    if (head) this.#setHead(head);
    this.#audible.clear();
  }
  #setHead(bytes) {
    const at = this.#copy(bytes);
    const status = this.carom.carom_run_set_head(this.run, at, bytes.length);
    this.carom.free(at);
    this.#check(status);
  }
  close() {
    if (this.run) this.carom.carom_run_close(this.run);
    this.run = 0;
  }

  /// What is heard from the next seek on: {format, follow, pose, kinds, only, silent: a Set of bodies}.
  hear({format = 'mono', follow = -1, pose, kinds = 7, only = -1, silent = null}) {
    if (follow < 0) this.#check(this.carom.carom_run_set_format(this.run, Math.max(0, kFormats.indexOf(format))));
    this.#check(this.carom.carom_run_follow(this.run, follow));
    if (pose) this.#check(this.carom.carom_run_place_ear(this.run, this.#poseAt(pose)));
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
    this.#check(this.carom.carom_run_set_ear(this.run, this.#poseAt(pose)));
  }
  seek(time, speed, prelude) {
    this.#check(this.carom.carom_run_seek(this.run, time, speed, prelude));
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
    this.#check(this.carom.carom_run_render(this.run, this.#planes, frames));
    return Array.from({length: this.channels}, (none, channel) =>
        new Float32Array(this.carom.memory.buffer, this.#planes + 4 * channel * frames, frames));
  }

  get duration() {
    return this.carom.carom_run_duration(this.run);
  }
  get time() {
    return this.carom.carom_run_time(this.run);
  }
  get late() {
    return this.carom.carom_run_late(this.run) >>> 0;
  }
}
