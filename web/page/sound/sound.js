// Live sound in the page: the audio context, the worklet with its engine, and the clock that it tells.
import workletText from 'carom:worklet';
import {playsRuns} from './engine.js';
import {unpack} from '../run/blobs.js';

/// Emits `at` with each report of the worklet, and `state` when sound begins, fails, or is not to be had.
/// Times of a run (s) at which there is much to render: its loudest collisions, and its middle.
function busyTimes(run) {
  const loud = [...run.events].sort((one, other) => other.peak - one.peak).slice(0, 2).map((event) => event.time);
  return [...loud, run.duration / 2];
}

export class Sound extends EventTarget {
  module = null;
  reason = '';         // why there is no sound; empty if there is, or may be
  late = 0;
  seekDelay = null;    // ms from the latest seek to its first sound
  #asked = 0;
  #context = null;
  #node = null;
  #made = null;        // the promise of both
  #opened = new Map(); // runs that the worklet has, by their index: another may take a run's place
  #fed = new WeakMap(); // pieces that it has of a run, by the run itself
  #line = Promise.resolve();
  #opening = null;
  #anchor = null;      // the worklet's latest report
  #lastId = 0;
  #least = 0;          // no earlier time than this is heard
  #gain = 1;
  #recorded = null;    // what a recorder hears
  #muted = false;

  /// Compiles the engine. Afterwards `reason` is empty if the page can sound.
  async prepare(runs) {
    try {
      if (!runs.some((run) => run.hasSound)) return this.#silent('it was made without sound');
      const bytes = await unpack('carom-engine');
      if (!bytes) return this.#silent('the engine is not in it');
      this.module = await WebAssembly.compile(bytes);
      if (!playsRuns(this.module)) return this.#silent('its engine cannot play runs');
      if (!globalThis.AudioContext || !globalThis.AudioWorkletNode) this.#silent('this browser has no AudioWorklet');
    } catch (error) {
      this.#silent(error.message);
    }
  }
  #silent(reason) {
    this.reason = reason;
    this.dispatchEvent(new Event('state'));
  }

  get on() {
    return this.#node !== null && this.#context.state === 'running';
  }
  get sampleRate() {
    return this.#context?.sampleRate ?? 48000;
  }
  /// True if engines can be made, so that offline renders work, even where no live sound does.
  get renders() {
    return this.module !== null && playsRuns(this.module);
  }

  /// Has to be called within a press, which browsers ask for before they let a page sound.
  async start(run, head) {
    if (this.reason) return false;
    try {
      await (this.#made ??= this.#make(run));   // a second press may come before the first is through
      if (this.#context.state !== 'running') await this.#context.resume();
      if (run.hasSound) await this.open(run, head);
    } catch (error) {
      this.#silent(error.message);
      return false;
    }
    this.dispatchEvent(new Event('state'));
    return true;
  }
  async #make(run) {
    this.#context = new AudioContext({sampleRate: run.sampleRate || 48000, latencyHint: 'interactive'});
    this.#context.resume();
    // Chromium refuses blob: for worklets of a page from file://, and takes data:.
    await this.#context.audioWorklet.addModule('data:text/javascript;charset=utf-8,' + encodeURIComponent(workletText));
    const node = new AudioWorkletNode(this.#context, 'carom', {
      numberOfInputs: 0, outputChannelCount: [2], processorOptions: {module: this.module},
    });
    node.port.onmessage = ({data}) => this.#take(data);
    node.onprocessorerror = () => this.#silent('the engine has failed');
    node.connect(this.#context.destination);
    this.#node = node;
    this.#sendVolume();
  }

  /// The tracks of what sounds, for a recorder: one, or none where there is no sound.
  recordedTracks() {
    if (!this.#node) return [];
    if (!this.#recorded) this.#node.connect(this.#recorded = this.#context.createMediaStreamDestination());
    return this.#recorded.stream.getAudioTracks();
  }

  /// Gives the worklet a run, unless it has it already. One after another, as each waits for an answer.
  open(run, head) {
    const opened = this.#line.then(() => this.#open(run, head));
    this.#line = opened.catch(() => {});
    return opened;
  }
  async #open(run, head) {
    if (this.#opened.get(run.index) === run) return;
    const bytes = await run.soundBytes();
    const answer = new Promise((resolve, reject) => {
      this.#opening = {resolve, reject};
      this.#node.port.postMessage({type: 'open', run: run.index, bytes, head, busy: busyTimes(run), ahead: run.growth?.ahead});
    });
    this.#fed.set(run, 0);
    this.feed(run);
    await answer;
    this.#opened.set(run.index, run);
  }
  /// Hands over what has come to a run that goes on (live/growth.js).
  feed(run) {
    if (!this.#fed.has(run) || !run.growth) return;
    const {pieces} = run.growth;
    for (let piece = this.#fed.get(run); piece < pieces.length; ++piece) {
      this.#node.port.postMessage({type: 'append', run: run.index, bytes: pieces[piece].sound});
    }
    this.#fed.set(run, pieces.length);
  }
  /// Takes back all but some portions of a run that goes on; a `go` has to follow. Pieces behind them
  /// are new.
  cut(run, portions) {
    if (!this.#fed.has(run)) return;
    this.#anchor = null;
    this.#fed.set(run, run.growth.pieces.filter((piece) => piece.portions <= portions).length);
    this.#node.port.postMessage({type: 'cut', run: run.index, portions});
  }
  /// Has another run take a run's place.
  forget(run) {
    this.#fed.delete(this.#opened.get(run.index));
    this.#opened.delete(run.index);
  }
  has(run) {
    return this.on && this.#opened.get(run.index) === run;
  }

  #take(message) {
    if (message.type === 'opened') return this.#opening?.resolve();
    if (message.type === 'sounds') return this.#tellDelay(message.id);
    if (message.type === 'failed') {
      this.#opening?.reject(new Error(message.message));
      return this.#silent(message.message);
    }
    this.late = message.late;
    if (message.id === this.#lastId) this.#anchor = message;
    this.dispatchEvent(Object.assign(new Event('at'), {report: message}));
  }

  /// Sounds from `order.time` on. The clock stands there until the first report.
  go(order) {
    this.#anchor = null;
    this.#least = order.loop ? Math.min(order.time, order.loop[0]) : order.time;
    this.#asked = performance.now();
    this.#node.port.postMessage({type: 'go', ...order, id: ++this.#lastId});
  }
  #tellDelay(id) {
    if (id === this.#lastId) this.seekDelay = performance.now() - this.#asked;
  }
  rest() {
    this.#anchor = null;
    ++this.#lastId;
    this.#node?.port.postMessage({type: 'rest'});
  }
  ear(pose) {
    this.#node?.port.postMessage({type: 'ear', pose});
  }
  /// True if `report` is of the present sound.
  isPresent(report) {
    return report.id === this.#lastId;
  }

  /// Where the simulation is of what is heard now; null until the worklet has told.
  heardTime(speed) {
    if (!this.#anchor) return null;
    if (this.#anchor.held) return Math.max(this.#least, this.#anchor.end);
    return Math.max(this.#least, this.#anchor.end + speed * (this.#heardAt() - this.#anchor.at));
  }
  /// Where the simulation is of what is rendered now, which is heard a little later; null until the worklet has told.
  renderedTime(speed) {
    if (!this.#anchor) return null;
    return this.#anchor.end + (this.#anchor.held ? 0 : speed * Math.max(0, this.#context.currentTime - this.#anchor.at));
  }
  get held() {
    return this.#anchor?.held ?? false;
  }
  /// The context's time of the sample that leaves the loudspeaker now.
  #heardAt() {
    const stamp = this.#context.getOutputTimestamp?.();
    if (stamp?.performanceTime > 0 && stamp.contextTime > 0) {
      const now = stamp.contextTime + (performance.now() - stamp.performanceTime) / 1000;
      if (Math.abs(now - this.#context.currentTime) < 0.5) return now;
    }
    return this.#context.currentTime - (this.#context.baseLatency || 0);
  }

  set gain(value) {
    this.#gain = value;
    this.#sendVolume();
  }
  set muted(value) {
    this.#muted = value;
    this.#sendVolume();
  }
  get muted() {
    return this.#muted;
  }
  #sendVolume() {
    this.#node?.port.postMessage({type: 'volume', value: this.#muted ? 0 : this.#gain});
  }
}
