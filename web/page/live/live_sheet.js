// The sheet of the live run: what is thrown, the world's settings, and what one takes along.
import {kLeastSize, kLeastSpeed, kMostSize, kMostSpeed} from './limits.js';
import {sizeWords} from './live_bar.js';
import {byId, make, quantity, setIcon} from '../text/dom.js';

const kMaterials = ['steel', 'glass', 'ceramic', 'billiard_ball', 'wood', 'rubber', 'plastic', 'brass', 'aluminium', 'lead', 'gold', 'granite',
                    'concrete', 'ice', 'cork', 'balsa'];
const kMostGravity = 20;                  // m/s^2
const kLongest = 1 / 30, kShortest = 1 / 1000;   // s: Bullet's step
const kWait = 120;                        // ms of rest before a slider acts, as each change has another mechanics take over

const minus = (text) => text.replace('-', '\u2212');

export class LiveSheet {
  #sliders = [];

  constructor(desk) {
    Object.assign(this, {desk, element: byId('live-sheet')});
    const close = make('button', {type: 'button', class: 'close', 'aria-label': 'Close', onclick: () => this.toggle(false)});
    setIcon(close, 'close');
    this.text = make('textarea', {readonly: true, rows: 5, 'aria-label': 'Text to copy', hidden: true});
    this.textWords = make('p', {class: 'quiet small', hidden: true});
    this.element.append(make('div', {class: 'top'}, make('h2', {}, 'Live'), close), ...this.#body(), ...this.#world(), ...this.#keep(), this.textWords, this.text);
  }
  toggle(open = this.element.hidden) {
    this.element.hidden = !open;
    byId('open-live').setAttribute('aria-expanded', String(open));
    this.text.hidden = this.textWords.hidden = true;
    if (open) this.show();
    else if (this.element.contains(document.activeElement)) byId('open-live').focus();
  }

  #button(words, act, more = {}) {
    return make('button', {type: 'button', onclick: act, ...more}, words);
  }
  #field(name, ...content) {
    return make('div', {class: 'field', role: 'group', 'aria-label': name}, make('h3', {}, name), make('div', {class: 'choices'}, ...content));
  }
  /// A slider whose value `read` gives and `write` takes, in the scale of the slider.
  #slider(name, {min, max, step, read, write, words, wait = 0}) {
    let timer = 0;
    const output = make('output', {});
    const input = make('input', {type: 'range', min, max, step, 'aria-label': name, oninput: () => {
      const value = Number(input.value);
      tell(value);
      clearTimeout(timer);
      if (wait) timer = setTimeout(() => this.desk.try(() => write(value)), wait); else write(value);
    }});
    const tell = (value) => {
      output.textContent = words(value);
      input.setAttribute('aria-valuetext', output.textContent);
    };
    this.#sliders.push(() => {
      const value = read();
      if (document.activeElement !== input || value !== null) input.value = value ?? (Number(min) + Number(max)) / 2;
      if (value === null) output.textContent = 'as made';
      else tell(value);
    });
    return this.#field(name, input, output);
  }

  #body() {
    const {desk} = this, {choice} = desk;
    const set = (more) => {
      Object.assign(choice, more);
      desk.bar.show();
      this.show();
    };
    this.shapes = [['sphere', 'Ball'], ['box', 'Box']].map(([shape, words]) => this.#button(words, () => set({shape}), {'data-shape': shape}));
    this.shapeWords = make('span', {class: 'quiet small'}, 'A box needs Bullet');
    this.materials = make('select', {'aria-label': 'Material', onchange: () => set({material: this.materials.value})},
                          ...kMaterials.map((name) => make('option', {value: name}, name.replaceAll('_', ' '))));
    return [
      this.#field('Body', ...this.shapes, this.materials, this.shapeWords),
      this.#slider('Size', {min: Math.log10(kLeastSize), max: Math.log10(kMostSize), step: 0.01, read: () => Math.log10(choice.size),
        write: (value) => set({size: 10 ** value}), words: (value) => sizeWords(10 ** value)}),
      this.#slider('Speed', {min: Math.log10(kLeastSpeed), max: Math.log10(kMostSpeed), step: 0.01, read: () => Math.log10(choice.speed),
        write: (value) => set({speed: 10 ** value}), words: (value) => quantity(10 ** value, 'm/s', 2)}),
      make('div', {class: 'acts'}, this.#button('Throw', () => desk.throwAt(), {title: 'Throw at the middle of the picture (R)'}),
           this.#button('Drop', () => desk.dropAt(), {title: 'Drop in the middle of the picture (X)'}),
           this.#button('Take back', () => desk.live.takeBack(), {title: 'Take back the latest change, and what came of it (Z)'})),
    ];
  }
  #world() {
    const {desk} = this, {live} = desk, settings = () => live.settings, known = (read) => () => (live.run ? read() : 0);
    const along = () => settings().gravity.reduce((sum, part, axis) => sum + part * live.gravityWay[axis], 0);
    const mean = (name) => known(() => settings()[name] ?? null);
    this.steppers = [['native', 'Native'], ['bullet', 'Bullet']].map(([stepper, words]) =>
      this.#button(words, () => desk.try(() => live.set({stepper})), {'data-stepper': stepper}));
    this.step = this.#slider('Bullet’s step', {min: Math.log10(kShortest), max: Math.log10(kLongest), step: 0.005, wait: kWait,
      read: known(() => Math.log10(settings().step)), write: (value) => live.set({step: 10 ** value}),
      words: (value) => `1/${Math.round(10 ** -value)}\u202fs`});
    return [
      this.#slider('Gravity', {min: -kMostGravity, max: kMostGravity, step: 0.1, wait: kWait, read: known(along),
        write: (value) => live.set({gravity: Math.abs(value) < 0.25 ? 0 : value}),
        words: (value) => minus(quantity(Math.abs(value) < 0.25 ? 0 : Number(value.toFixed(2)), 'm/s²', 3))}),
      this.#slider('Restitution', {min: 0, max: 1, step: 0.01, wait: kWait, read: mean('restitution'),
        write: (value) => live.set({restitution: value}), words: (value) => value.toFixed(2)}),
      this.#slider('Friction', {min: 0, max: 1.5, step: 0.01, wait: kWait, read: mean('friction'),
        write: (value) => live.set({friction: value}), words: (value) => value.toFixed(2)}),
      this.#field('Mechanics', ...this.steppers), this.step,
    ];
  }
  #keep() {
    const {desk} = this;
    return [this.#field('Take along',
        this.#button('Save run', () => desk.keep.saveRun(), {title: 'What has happened, as a file for "carom replay" and "carom view"'}),
        this.#button('Copy scene', () => desk.keep.copyScene(), {title: 'The scene as it is now, as JSON'}),
        this.#button('Copy link', () => desk.keep.copyLink(), {title: 'The address of this page with the scene as it is now'}),
        this.#button('Begin again', () => desk.live.beginAgain().catch((error) => desk.bar.say(error.message)), {title: 'From the scene’s beginning'}))];
  }
  showText(text, words) {
    this.toggle(true);
    this.textWords.textContent = words;
    this.text.value = text;
    this.text.hidden = this.textWords.hidden = false;
    this.text.focus();
    this.text.select();
  }

  /// Puts everything as it is now.
  show() {
    const {desk} = this, {live, choice} = desk;
    if (!live.running) this.element.hidden = true;
    if (this.element.hidden) return;
    const onBullet = live.settings.stepper === 'bullet';
    for (const button of this.steppers) button.setAttribute('aria-pressed', String((button.dataset.stepper === 'bullet') === onBullet));
    if (!onBullet) choice.shape = 'sphere';
    for (const button of this.shapes) {
      button.setAttribute('aria-pressed', String(button.dataset.shape === choice.shape));
      button.disabled = button.dataset.shape === 'box' && !onBullet;
    }
    this.shapeWords.hidden = onBullet;
    this.step.hidden = !onBullet;
    this.materials.value = choice.material;
    for (const put of this.#sliders) put();
  }
}
