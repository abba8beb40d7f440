// The page as a whole: what is shown, selected and heard, and what keys do.
import {Desk} from './live/desk.js';
import {isGallery, otherRuns} from './run/choice.js';
import {namesOf} from './run/data.js';
import {Keys} from './text/keys.js';
import {Mixer} from './text/mixer.js';
import {Panel} from './text/panel.js';
import {fillSheets, toggleSheet} from './text/sheets.js';
import {followTheme} from './text/theme.js';
import {byId, decibelWords, make, microseconds, setIcon} from './text/dom.js';
import {keysOf} from './text/key_table.js';
import {Recorder} from './film/recorder.js';

const kStill = 5;      // pixels that a click may move
const kTooSlow = 0.06, kSlowPictures = 4;   // s from picture to picture, and how many in a row
const kBegin = 62;     // pixels above the bar, where the button to begin is
const kStep = 0.02;    // of the shown stretch of time, for an arrow key

export class View {
  selected = null;
  body = null;
  stale = true;         // the picture has to be drawn
  held = false;         // a film has the stage (film/film.js), which the page leaves alone
  filming = false;      // the page records itself (film/recorder.js), so that pictures keep their size
  slow = 0;
  #last = performance.now();
  #sentEar = '';
  #others = null;       // a list of runs that are not shown
  #turn = (now) => this.#draw(now);

  constructor(parts) {
    Object.assign(this, parts);
    const does = {
      select: (event) => this.select(event), selectBody: (id) => this.selectBody(id), alone: (event) => this.player.alone(event),
      step: (way, body) => this.step(way, body), close: () => this.close(), volume: (decibels) => this.setVolume(decibels), mute: () => this.mute(),
    };
    this.panel = new Panel(this.ear, does);
    this.mixer = new Mixer(this.ear, this.hasHead, does);
    this.bar.serve(does);
    this.live = new Desk(this, this.blobs);
    this.recorder = new Recorder(this);
    this.keys = new Keys(keysOf(this));
    this.ear.format = this.hasHead ? 'head' : 'pair';
  }

  begin() {
    document.querySelectorAll('[data-icon]').forEach((element) => setIcon(element, element.dataset.icon));
    fillSheets(this.manifest.version);
    this.setTitle(isGallery(this.manifest) ? this.runs[0].name : this.manifest.title);
    this.#others = otherRuns(this.manifest, this.runs, this.player);
    if (this.#others) byId('runs').after(this.#others);
    this.offerRuns();
    this.#listen();
    this.#layout();
    this.#show();
    followTheme((theme) => {
      this.touch();
      this.stage.paint(theme);
      this.bar.paint(theme);
    });
    this.ear.pose = this.stage.cameraPose();
    this.#tellEar();
    requestAnimationFrame(this.#turn);
  }
  #listen() {
    const {player, ear, stage} = this;
    new ResizeObserver(() => this.#layout()).observe(byId('main'));
    new ResizeObserver(() => this.#layout()).observe(byId('bar'));
    player.addEventListener('change', () => this.#changed());
    ear.addEventListener('change', () => this.#tellEar());
    player.addEventListener('jump', () => this.touch());
    this.bar.window.addEventListener('change', () => this.touch());
    this.sound.addEventListener('state', () => this.soundIsKnown());
    byId('begin-button').onclick = () => player.play();
    byId('runs').addEventListener('keydown', (event) => {
      const way = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key];
      if (!way) return;
      event.preventDefault();
      this.nextRun(way);
      byId('runs').children[this.player.runIndex].focus();
    });
    byId('show-all').onclick = () => this.showAll();
    byId('open-help').onclick = () => toggleSheet('help');
    byId('open-about').onclick = () => toggleSheet('about');
    byId('open-mixer').onclick = () => this.mixer.toggle();
    let down = null;
    stage.canvas.addEventListener('pointerdown', (event) => down = [event.clientX, event.clientY]);
    stage.canvas.addEventListener('pointerup', (event) => {
      if (event.defaultPrevented || !down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > kStill) return;
      const body = stage.pick(event.clientX, event.clientY);
      if (body === null) this.close(); else this.selectBody(body);
    });
  }

  setTitle(title) {
    byId('title').textContent = title.replaceAll('_', ' ');
  }
  /// Shows which runs there are; again when a live one has come.
  offerRuns() {
    const runs = byId('runs');
    byId('choice').hidden = this.runs.length < 2 && !this.#others && !this.live.offers;
    runs.hidden = this.runs.length < 2;
    runs.replaceChildren(...this.runs.map((run, index) => make('button', {type: 'button', role: 'radio', 'aria-checked': 'false', onclick: () => this.player.setRun(index),
      title: `${run.label} (${index + 1})`}, run.label)));
    this.#checkRun();
  }
  #checkRun() {
    [...byId('runs').children].forEach((button, index) => {
      const checked = index === this.player.runIndex;
      button.setAttribute('aria-checked', String(checked));
      button.tabIndex = checked ? 0 : -1;
    });
  }
  nextRun(way) {
    this.player.setRun((this.player.runIndex + way + this.runs.length) % this.runs.length);
  }

  /// Shows the player's run; selection of an event ends, as the other run has others.
  #show() {
    const {run} = this.player;
    if (this.shown === run) return;
    this.shown = run;
    this.stage.show(run);
    this.bar.show(run, this.stage.looks);
    this.mixer.show(run, this.stage.looks);
    this.close();
    byId('about-scene').hidden = !run.description;
    byId('description').textContent = run.description ?? '';
    this.#checkRun();
  }
  #changed() {
    this.touch();
    this.#show();
    if (this.player.playing) document.body.classList.add('begun');
    else if (!this.filming && !this.held) this.stage.refine();
  }

  /// Says what the page sounds like, once that is known: with sound, or why not.
  soundIsKnown() {
    const {sound} = this, reason = sound.reason || (this.player.run.hasSound ? '' : 'this run has none');
    document.body.classList.toggle('silent', reason !== '');
    byId('begin-words').textContent = reason ? 'This page is without sound' : 'The sound is computed here, by Carom';
    byId('heard-words').textContent = reason ? `Without sound: ${reason}.` : this.bar.spectrogram.empty ? 'The spectrum of what you hear appears here.' : '';
    this.bar.tell();
  }

  #layout() {
    if (this.held) return;
    this.touch();
    const {clientWidth: width, clientHeight: height} = byId('main');
    const bar = byId('bar').offsetHeight;
    byId('main').style.setProperty('--bar', `${bar}px`);
    this.stage.resize(width, height, {top: 58, bottom: bar + kBegin});
    this.bar.resize();
    if (this.stage.run && !this.stage.touched) this.stage.reset();
  }

  select(event) {
    if (!event) return;
    this.selected = event;
    this.player.seek(event.time);
    this.bar.select(event);
    this.panel.showEvent(this.player.run, this.stage.looks, event, this.sound.renders && !this.sound.reason);
    const [one, two] = namesOf(this.player.run, event);
    byId('note').textContent = `${one}${two ? ` and ${two}` : ''}, ${decibelWords(event.level)}, at ${microseconds(event.time)}`;
  }
  selectBody(id) {
    this.selected = null;
    this.body = id;
    this.bar.select(null);
    this.panel.showBody(this.player.run, this.stage.looks, id);
    byId('note').textContent = this.player.run.byId.get(id)?.name ?? '';
  }
  showAll() {
    this.stage.reset();
    this.touch();
  }
  nextBody(way = 1) {
    const {bodies} = this.player.run;
    const at = bodies.findIndex((body) => body.id === this.body);
    this.selectBody(bodies[(at + way + bodies.length) % bodies.length].id);
  }
  close() {
    this.selected = null;
    this.body = null;
    this.bar.select(null);
    this.panel.hide();
  }

  /// To the next event or the one before, of a body if one is given.
  step(way, body = null) {
    const {events} = this.player.run;
    let index = this.selected && Math.abs(this.selected.time - this.player.time) < 1e-9 ? this.selected.index + way
        : this.bar.timeline.first(this.player.time) + (way < 0 ? -1 : 0);
    while (events[index] && body !== null && events[index].body !== body && events[index].other !== body) index += way;
    if (events[index]) this.select(events[index]);
  }
  move(steps) {
    this.player.seek(this.player.time + steps * kStep * this.bar.window.span);
    this.bar.window.show(this.player.time);
  }
  loopFrom(begin, time) {
    const loop = this.player.loop ?? [0, this.player.duration];
    this.player.setLoop(begin ? [time, Math.max(loop[1], time)] : [Math.min(loop[0], time), time]);
  }

  mute() {
    this.sound.muted = !this.sound.muted;
    this.bar.tell();
  }
  setVolume(decibels) {
    this.sound.gain = this.gain * 10 ** (decibels / 20);
  }
  setEar(pose) {
    this.ear.pose = pose;
    this.ear.setMode('stay');
  }
  /// The next place to hear from: with the camera, staying, and each listener of the run.
  nextEar() {
    const {ear} = this, {listeners} = this.player.run;
    if (ear.mode === 'camera') return ear.setMode('stay');
    const next = ear.mode === 'stay' ? 0 : ear.listener + 1;
    return next < listeners.length ? ear.setMode('listener', next) : ear.setMode('camera');
  }
  nextFormat() {
    const formats = this.hasHead ? ['mono', 'pair', 'head'] : ['mono', 'pair'];
    this.ear.setFormat(formats[(formats.indexOf(this.ear.format) + 1) % formats.length]);
  }
  #tellEar() {
    this.touch();
    const {ear} = this;
    const place = {camera: 'Camera', stay: 'Stays', listener: this.player.run.listeners[ear.listener]?.name ?? 'Listener'}[ear.mode];
    const words = ear.mode === 'listener' ? place : `${place} · ${ear.format}`;
    byId('ear-words').textContent = words;
    byId('open-mixer').setAttribute('aria-label', `Sound. Ear: ${words}`);
  }

  /// The ear goes with the camera; while it sounds the worklet is told of every move.
  #moveEar() {
    const {ear} = this;
    if (ear.mode !== 'camera') return;
    ear.pose = this.stage.cameraPose();
    const sent = ear.pose.join();
    if (sent === this.#sentEar) return;
    this.#sentEar = sent;
    if (this.player.playing && this.sound.on) this.sound.ear(ear.pose);
  }

  #draw(now) {
    if (this.held) return;
    const seconds = (now - this.#last) / 1000;
    this.#last = now;
    this.live.pump(now);
    this.player.tick(now);
    const flies = this.keys.fly(this.stage, seconds), settles = this.stage.settle();
    if (this.player.playing && !this.filming) this.#watchPace(seconds);
    if (this.player.playing || flies || settles || this.stale) this.drawNow();
    requestAnimationFrame(this.#turn);
  }
  /// Pictures that come too slowly, one after another, get fewer pixels.
  #watchPace(seconds) {
    this.slow = seconds > kTooSlow ? this.slow + 1 : 0;
    if (this.slow < kSlowPictures) return;
    this.slow = 0;
    this.stage.coarsen();
  }
  /// Has the picture drawn once more although nothing plays.
  touch() {
    this.stale = true;
  }
  drawNow() {
    this.stale = false;
    const {time, speed} = this.player;
    this.stage.draw(time, speed, this.ear);
    this.#moveEar();
    this.bar.draw(time);
  }
  screenshot() {
    this.drawNow();
    return this.stage.canvas.toDataURL('image/png');
  }
}
