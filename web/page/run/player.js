// Time: what plays, where, how fast, and in which run. The sound's clock leads where there is sound.

export const kSlowest = 1 / 1000;
const kAlone = 0.7;       // s of an event's own click
const kLead = 0.012;      // s before it

/// Emits `change` (playing, speed, loop, run) and `jump` (the time was set).
export class Player extends EventTarget {
  playing = false;
  speed = 1;
  loop = null;            // [begin, end] in s, or null
  only = -1;              // the row of the event that is heard alone
  #time = 0;
  #run = 0;
  #heldBack = null;       // where to return after a click alone
  #last = 0;
  #until = Infinity;

  constructor(runs, sound, ear, head) {
    super();
    Object.assign(this, {runs, sound, ear, head});
    sound.addEventListener('at', ({report}) => {
      if (!report.playing && this.playing && sound.isPresent(report)) this.#ended();
    });
    sound.addEventListener('state', () => this.#changed());
    ear.addEventListener('change', () => this.#resound());
  }

  get run() {
    return this.runs[this.#run];
  }
  get time() {
    return this.#time;
  }
  get duration() {
    return this.run.duration;
  }
  /// A run that is open goes on.
  get end() {
    return Math.min(this.run.open ? Infinity : this.duration, this.#until);
  }
  #changed() {
    this.dispatchEvent(new Event('change'));
  }
  #sounds() {
    return this.sound.has(this.run);
  }
  /// True if the sound's clock leads.
  get hasSound() {
    return this.#sounds();
  }

  seek(time) {
    this.#release();
    this.#put(time);
  }
  #put(time) {
    this.#time = Math.min(this.duration, Math.max(0, Number(time) || 0));
    this.dispatchEvent(new Event('jump'));
    this.#resound();
  }
  /// The sound begins anew where the time is, as it does after every change of what is heard.
  #resound() {
    if (!this.playing || !this.#sounds()) return;
    const loops = this.loop && this.#time < this.loop[1] && this.only < 0;
    this.sound.go({run: this.#run, time: this.#time, speed: this.speed, until: this.end, loop: loops ? this.loop : null,
                   hear: this.ear.order(this.run, this.only)});
  }

  async play() {
    if (this.#time >= this.end - 1e-9) this.#time = this.loop ? this.loop[0] : 0;
    const {run} = this;
    await this.sound.start(run, await this.head());
    this.playing = true;
    this.#last = performance.now();
    this.#resound();
    this.#changed();
    if (run !== this.run) await this.#openRun();   // another was chosen meanwhile
  }
  /// Plays a stretch once, from its begin to its end, without its loop.
  once([from, to]) {
    this.#release();
    this.loop = null;
    this.#until = to;
    this.#time = from;
    return this.play();
  }
  pause() {
    this.#release();
    this.playing = false;
    this.sound.rest();
    this.#changed();
  }
  toggle() {
    return this.playing ? this.pause() : this.play();
  }

  setSpeed(speed) {
    this.speed = Math.min(1, Math.max(kSlowest, speed));
    this.#resound();
    this.#changed();
  }
  setLoop(range) {
    this.loop = range && range[1] - range[0] > 1e-6 ? [Math.max(0, range[0]), Math.min(this.duration, range[1])] : null;
    if (this.loop && (this.#time < this.loop[0] || this.#time > this.loop[1])) this.#time = this.loop[0];
    this.#resound();
    this.#changed();
  }

  /// Another run of the same scene, at the same time, playing as before.
  async setRun(index) {
    if (index === this.#run || !this.runs[index]) return;
    this.#release();
    if (this.playing) this.sound.rest();
    this.#run = index;
    this.#time = Math.min(this.#time, this.duration);
    this.#changed();
    await this.#openRun();
  }
  /// The run that is shown has become another one, in the same place.
  renewRun() {
    this.#release();
    this.#changed();
    return this.#openRun();
  }
  async #openRun() {
    const {run} = this;
    if (this.sound.on) await this.sound.start(run, await this.head());
    if (run === this.run) this.#resound();
  }
  get runIndex() {
    return this.#run;
  }

  /// Plays the sound of one event alone, then returns to where it was.
  async alone(event) {
    const back = this.#heldBack ?? {time: this.#time, playing: this.playing};
    this.#heldBack = back;
    this.only = event.row;
    this.#until = event.time + Math.max(kAlone * Math.min(1, 4 * this.speed), 2 * event.duration);
    this.#time = Math.max(0, event.time - kLead);
    await this.play();
  }
  #release() {
    this.only = -1;
    this.#until = Infinity;
    this.#heldBack = null;
  }
  #ended() {
    const back = this.#heldBack;
    if (!back) {
      this.#time = this.end;
      return this.pause();
    }
    this.#release();
    this.playing = back.playing;
    this.sound.rest();
    this.#put(back.time);
    this.#changed();
  }

  /// Each picture: moves the time on. Follows the sound's clock without its jitter.
  tick(now) {
    const step = Math.min(0.25, (now - this.#last) / 1000) * this.speed;
    this.#last = now;
    if (!this.playing) return;
    const heard = this.#sounds() ? this.sound.heardTime(this.speed) : undefined;
    if (heard === null) return;
    let next = this.#time + step;
    if (heard !== undefined) {
      const error = heard - next;
      next = Math.abs(error) > 0.08 * this.speed ? heard : next + 0.1 * error;
    }
    this.#time = Math.max(0, next);
    if (heard === undefined) this.#watchEnds();
    this.#time = Math.min(this.#time, this.loop && this.only < 0 && this.#time > this.loop[1] && heard !== undefined ? this.loop[1] : this.end);
    if (this.run.open) this.#time = Math.min(this.#time, this.duration);
  }
  #watchEnds() {
    if (this.loop && this.only < 0 && this.#time >= this.loop[1]) this.#time = this.loop[0];
    else if (this.#time >= this.end) this.#ended();
  }
}
