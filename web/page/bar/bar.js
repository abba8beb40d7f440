// The bar at the bottom: transport, clock, speed, time line and spectrogram.
import {namesOf} from '../run/data.js';
import {kSlowest} from '../run/player.js';
import {byId, decibelWords, make, microseconds, setIcon, speedWords} from '../text/dom.js';
import {Gestures} from './gestures.js';
import {Spectrogram} from './spectrogram.js';
import {Timeline} from './timeline.js';
import {Window} from './window.js';

const kFirst = 5, kLonger = 1.6;   // s that a run which goes on has room for at first, and by how much more each time

function roomFor(duration) {
  let room = kFirst;
  while (room < duration) room *= kLonger;
  return room;
}

export class Bar {
  constructor(player, sound, ear) {
    Object.assign(this, {player, sound, ear});
    this.line = byId('line');
    this.window = new Window(player.duration);
    this.timeline = new Timeline(byId('marks'), this.window, ear);
    this.spectrogram = new Spectrogram(byId('spectrum'), this.window);
    this.window.addEventListener('change', () => this.#redraw());
    ear.addEventListener('change', () => this.timeline.draw());
    sound.addEventListener('at', ({report}) => this.#hear(report));
    player.addEventListener('change', () => this.tell());
    this.#listen();
  }
  #hear(report) {
    this.spectrogram.hear(report, this.sound.sampleRate);
    if (!this.spectrogram.empty) byId('heard-words').textContent = '';
  }
  #listen() {
    const {player} = this;
    byId('play').onclick = () => player.toggle();
    byId('previous').onclick = () => this.does.step(-1);
    byId('next').onclick = () => this.does.step(1);
    byId('loop').onclick = () => this.toggleLoop();
    byId('mute').onclick = () => this.does.mute();
    const slider = byId('speed-slider');
    slider.oninput = () => player.setSpeed(10 ** Number(slider.value));
    new Gestures(this.line, this.timeline, this.window, {
      scrub: (time) => player.seek(time), choose: (event) => this.does.select(event),
      loop: (range) => player.setLoop(range), hover: (event, x) => this.#hover(event, x),
    });
  }
  /// `does` has step(way), select(event), mute().
  serve(does) {
    this.does = does;
  }

  show(run, looks) {
    this.run = run;
    const whole = !this.window.zoomed;
    const length = run.open ? roomFor(run.duration) : run.duration;
    this.window.duration = length;
    this.timeline.show(run, looks);
    this.window.set(this.window.begin, whole ? length : this.window.end);
    this.line.setAttribute('aria-valuemax', run.duration.toFixed(6));
    this.spectrogram.forget();
    this.tell();
  }
  /// Shows more of a run that goes on. The line gets longer in steps, as all of it moves then.
  grow() {
    const {run, window} = this, length = Math.max(roomFor(run.duration), run.duration);
    this.timeline.measure();
    this.line.setAttribute('aria-valuemax', run.duration.toFixed(6));
    if (length === window.duration) return this.timeline.draw();
    const whole = !window.zoomed;
    window.duration = length;
    return window.set(whole ? 0 : window.begin, whole ? length : window.end);
  }
  /// Bodies have come or gone.
  recolour() {
    this.timeline.paint(this.timeline.theme);
  }
  paint(theme) {
    this.timeline.paint(theme);
    this.spectrogram.paint(theme);
  }
  resize() {
    const {width} = this.line.getBoundingClientRect();
    this.timeline.resize(width, byId('marks').clientHeight);
    this.spectrogram.resize(width, byId('heard').clientHeight);
    this.#redraw();
  }
  #redraw() {
    this.timeline.draw();
    this.spectrogram.redraw();
    this.#placeRange();
  }
  select(event) {
    this.timeline.selected = event;
    if (event) this.window.show(event.time);
    this.timeline.draw();
  }

  toggleLoop() {
    const {player, window} = this;
    player.setLoop(player.loop ? null : window.zoomed ? [window.begin, window.end] : [0, player.duration]);
  }
  faster(factor) {
    this.player.setSpeed(Math.max(kSlowest, this.player.speed * factor));
  }
  #placeRange() {
    const {loop} = this.player, range = byId('range');
    range.hidden = !loop;
    if (!loop) return;
    const from = Math.max(0, this.timeline.x(loop[0])), to = Math.min(this.timeline.width, this.timeline.x(loop[1]));
    range.style.left = `${from}px`;
    range.style.width = `${Math.max(0, to - from)}px`;
  }

  /// What has changed in the player, on its buttons.
  tell() {
    const {player, sound} = this, button = byId('play');
    setIcon(button, player.playing ? 'pause' : 'play');
    button.title = player.playing ? 'Pause (space)' : 'Play (space)';
    button.setAttribute('aria-label', player.playing ? 'Pause' : 'Play');
    byId('loop').setAttribute('aria-pressed', String(player.loop !== null));
    setIcon(byId('mute'), sound.muted ? 'muted' : 'sound');
    byId('mute').setAttribute('aria-pressed', String(sound.muted));
    byId('speed-slider').value = Math.log10(player.speed);
    byId('speed-words').textContent = speedWords(player.speed);
    byId('speed-slider').setAttribute('aria-valuetext', speedWords(player.speed));
    this.#placeRange();
  }

  draw(time) {
    if (this.player.playing && this.window.zoomed && this.player.only < 0) this.window.show(time);
    const x = this.timeline.x(time), head = byId('head-line');
    head.style.transform = `translateX(${x.toFixed(2)}px)`;
    head.hidden = x < -1 || x > this.timeline.width + 1;
    this.spectrogram.draw();
    const words = microseconds(time);
    if (words === this.shown) return;
    this.shown = words;
    byId('clock').replaceChildren(make('b', {}, words), make('span', {class: 'quiet'}, ` of ${this.run.open ? this.player.duration.toFixed(1) : Number(this.player.duration.toPrecision(4))}\u202fs`));
    this.line.setAttribute('aria-valuenow', time.toFixed(6));
    this.line.setAttribute('aria-valuetext', words);
  }

  #hover(event, x) {
    const tip = byId('hover');
    tip.hidden = !event;
    this.line.style.cursor = event ? 'pointer' : '';
    if (!event) return;
    const [one, two] = namesOf(this.run, event);
    tip.replaceChildren(make('b', {}, two ? `${one} · ${two}` : one), make('br'), `${microseconds(event.time)} · ${decibelWords(event.level)}`);
    const half = tip.offsetWidth / 2;
    tip.style.left = `${Math.min(this.timeline.width - half, Math.max(half, x))}px`;
  }
}
