// Live sound: an engine in the audio thread, driven by messages of the page (sound.js).
//   open {run, bytes, head, busy, ahead}   takes a run, at some of whose times much happens; answered by opened or failed.
//                                  One that goes on has `ahead`, s that it has to be known before it sounds
//   append {run, bytes}, cut {run, portions}       more of a run that goes on; some of it taken back, before a `go`
//   go {id, run, time, speed, until, loop, hear}   sounds from `time` on; all that is heard is in it, so that no order matters
//   rest                           fades out and stops
//   ear {pose}                     moves the ear, smoothly
//   volume {value}                 full scale per Pa
import {Engine} from './engine.js';

const kReport = 8;          // quanta between two reports to the page
const kSeekBudget = 20;     // ms that the prelude of a seek may take, of the 60 within which it has to sound
const kMeasured = 0.25;     // s of sound that the cost of rendering is measured over
const kWarming = 10;        // blocks of 512 samples that are rendered and dropped before the first sound
const kPrelude = 1.0;       // s at most: what rang before that is mostly gone

/// Keeps peaks below full scale without a corner: straight up to 0.7, then ever flatter.
function limit(value) {
  const size = Math.abs(value);
  if (size <= 0.7) return value;
  return Math.sign(value) * (0.7 + 0.3 * Math.tanh((size - 0.7) / 0.3));
}

class CaromProcessor extends AudioWorkletProcessor {
  constructor({processorOptions}) {
    super();
    this.module = processorOptions.module;
    this.engines = new Map();   // by run, each an instance, so that a switch between runs needs no opening
    this.engine = null;         // the one that sounds
    this.gain = 1;
    this.aim = 1;         // what `gain` moves towards, so that the volume has no steps
    this.cost = 0.25;     // s of work for a second of sound, measured at seeks and while it plays
    this.work = 0;        // ms of rendering since `cost` was last measured
    this.made = 0;        // s of sound since then
    this.playing = false;
    this.fades = true;    // the next quantum fades in
    this.next = null;     // a `go` that waits for the end of the present quantum
    this.held = false;    // a run that goes on is not known far enough: silence, and its time stands
    this.tail = null;     // the last samples before a cut, which fade out
    this.now = null;      // the `go` that sounds
    this.heard = new Float32Array(kReport * 128);
    this.filled = 0;
    this.begin = 0;
    this.port.onmessage = ({data}) => this.take(data);
  }

  take(message) {
    try {
      this[message.type](message);
    } catch (error) {
      this.fail(error);
    }
  }
  fail(error) {
    this.playing = false;
    this.next = null;
    this.port.postMessage({type: 'failed', message: error.message});
  }

  open({bytes, head, run, busy, ahead}) {
    const engine = new Engine(this.module);
    engine.open(bytes, sampleRate, head);
    engine.ahead = ahead;
    if (ahead) engine.setOpen();
    // The first sound of an instance takes longer, as its code is compiled when it is used, and filters
    // are made for the bodies that are heard first.
    engine.hear({format: head ? 'head' : 'pair'});
    for (const time of busy) {
      engine.seek(time, 1, 0);
      for (let block = 0; block < kWarming; ++block) engine.render(512);
    }
    if (this.engine === this.engines.get(run)) this.playing = false;
    this.engines.set(run, engine);
    this.port.postMessage({type: 'opened', run});
  }
  append({run, bytes}) {
    this.engines.get(run)?.append(bytes);
  }
  /// What sounds of a run that is cut fades out, in samples that were made before.
  cut({run, portions}) {
    const engine = this.engines.get(run);
    if (this.playing && this.engine === engine && !this.held) this.tail = engine.render(128).map((plane) => plane.slice());
    if (this.engine === engine) this.playing = this.held = false;
    engine?.cut(portions);
  }
  go(message) {
    this.next = message;
  }
  rest() {
    this.next = this.playing ? {type: 'rest'} : null;
  }
  /// A loop that begins again, and an order that waits, are heard from there as well.
  ear({pose}) {
    for (const order of [this.now, this.next]) if (order?.hear) order.hear.pose = pose;
    if (this.playing) this.engine.moveEar(pose);
  }
  volume({value}) {
    this.aim = value;
  }

  /// True if all that is needed to render on from `time` is known. What is not would come too late to be heard.
  knows(engine, time, speed, frames) {
    return !engine.ahead || engine.known >= time + speed * (engine.ahead + frames / sampleRate);
  }

  /// Begins to sound at a time. The prelude is as long as this machine renders within the budget.
  start(go) {
    const prelude = Math.min(kPrelude, go.time / go.speed, kSeekBudget / 1000 / this.cost);
    const before = Date.now();
    this.engine = this.engines.get(go.run);
    this.engine.hear(go.hear);
    this.engine.seek(go.time, go.speed, prelude);
    const took = (Date.now() - before) / 1000;
    if (prelude > 0.02) this.learn(took / prelude);
    this.now = go;
    this.playing = true;
    this.held = false;
    this.fades = true;
    this.filled = 0;
    this.begin = go.time;
  }

  process(inputs, outputs) {
    try {
      this.quantum(outputs[0]);
    } catch (error) {
      this.fail(error);
    }
    return true;
  }

  quantum(output) {
    const frames = output[0].length;
    if (this.tail) {
      this.write(this.tail, output, frames, -1 / frames);
      this.tail = null;
      return;
    }
    if (!this.playing && this.next) this.turn(frames);
    if (!this.playing || (this.held && !this.goesOn(frames))) return;
    const planes = this.render(frames);
    const held = !this.next && !this.knows(this.engine, this.engine.time, this.now.speed, frames);
    const rate = this.next || held ? -1 / frames : this.fades ? 1 / frames : 0;
    this.write(planes, output, frames, rate);
    if (this.fades) this.port.postMessage({type: 'sounds', id: this.now.id});
    const began = this.fades;
    this.fades = false;
    this.keep(planes, frames);
    if (held) this.hold();
    else if (began && this.engine.ahead) this.report(true);
    if (this.next) this.turn(frames);
    else this.watchEnds();
  }
  hold() {
    this.held = true;
    this.fades = true;
    this.report(true);
  }
  /// True once a sound that was held may go on; at once if something else is to sound.
  goesOn(frames) {
    if (this.next) {
      this.playing = false;
      this.turn(frames);
      return this.playing;
    }
    this.held = !this.knows(this.engine, this.engine.time, this.now.speed, frames);
    return !this.held;
  }

  /// The clock has steps of 1 ms, so that the work of many quanta tells more than that of one.
  render(frames) {
    const before = Date.now();
    const planes = this.engine.render(frames);
    this.work += Date.now() - before;
    this.made += frames / sampleRate;
    if (this.made > kMeasured) {
      this.learn(this.work / 1000 / this.made);
      this.work = this.made = 0;
    }
    return planes;
  }
  /// Dearer than thought counts at once, cheaper by and by.
  learn(cost) {
    this.cost = Math.max(0.004, cost, 0.6 * this.cost + 0.4 * cost);
  }

  /// Takes the order that waited, now that the sound has faded. One for what is not known yet waits on.
  turn(frames) {
    const next = this.next;
    this.playing = false;
    if (next.type === 'go' && !this.knows(this.engines.get(next.run), next.time, next.speed, 8 * frames)) return;
    this.next = null;
    if (next.type === 'go') this.start(next);
    else this.report(false);
  }
  watchEnds() {
    const time = this.engine.time, {loop, until} = this.now;
    if (loop && time >= loop[1]) this.next = {...this.now, time: loop[0]};
    else if (time >= until) this.next = {type: 'rest'};
  }

  write(planes, output, frames, rate) {
    let fade = rate > 0 ? 0 : 1;
    for (let frame = 0; frame < frames; ++frame) {
      this.gain += 0.002 * (this.aim - this.gain);
      fade += rate;
      for (let channel = 0; channel < output.length; ++channel) {
        const plane = planes[Math.min(channel, planes.length - 1)];
        output[channel][frame] = limit(plane[frame] * this.gain * fade);
      }
    }
  }

  /// Collects what is heard, as one channel, for the spectrogram.
  keep(planes, frames) {
    const share = 1 / planes.length;
    for (let frame = 0; frame < frames; ++frame) {
      let sum = 0;
      for (const plane of planes) sum += plane[frame];
      this.heard[this.filled + frame] = share * sum;
    }
    this.filled += frames;
    if (this.filled >= this.heard.length) this.report(true);
  }
  report(playing) {
    const samples = this.heard.slice(0, this.filled);
    const end = this.engine.time;
    this.port.postMessage({type: 'at', id: this.now?.id ?? 0, begin: this.begin, end, playing, held: this.held, samples,
                           at: currentTime + 128 / sampleRate, late: this.engine.late}, [samples.buffer]);
    this.begin = end;
    this.filled = 0;
  }
}
registerProcessor('carom', CaromProcessor);
