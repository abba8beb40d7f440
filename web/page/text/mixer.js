// The sheet of sound: where the ear is, its format, volume, kinds of sound, and solo and mute of each body.
import {kKinds} from '../sound/ear.js';
import {cssOf} from '../stage/colours.js';
import {byId, make, setIcon} from './dom.js';

const kShown = 120;   // rows of bodies before one has to search

export class Mixer {
  /// `does` has selectBody(id), volume(dB), close().
  constructor(ear, hasHead, does) {
    Object.assign(this, {ear, hasHead, does, element: byId('mixer'), words: ''});
    this.decibels = 0;
    ear.addEventListener('change', () => !this.element.hidden && this.draw());
  }
  toggle(open = this.element.hidden) {
    this.element.hidden = !open;
    byId('open-mixer').setAttribute('aria-expanded', String(open));
    if (open) this.draw();
    else if (this.element.contains(document.activeElement)) byId('open-mixer').focus();
  }
  show(run, looks) {
    Object.assign(this, {run, looks});
    if (!this.element.hidden) this.draw();
  }

  draw() {
    // Drawn anew, the sheet must not lose the reader's place.
    const focus = this.element.contains(document.activeElement) ? document.activeElement.dataset.key : null;
    const scroll = this.element.scrollTop;
    const close = make('button', {type: 'button', class: 'close', 'aria-label': 'Close', onclick: () => this.toggle(false)});
    setIcon(close, 'close');
    this.element.replaceChildren(make('div', {class: 'top'}, make('h2', {}, 'Sound'), close),
                                 this.#place(), this.#formats(), this.#volume(), this.#kinds(), this.#bodies());
    this.element.scrollTop = scroll;
    if (focus) this.element.querySelector(`[data-key="${CSS.escape(focus)}"]`)?.focus();
  }

  #choice(key, words, pressed, act, title) {
    return make('button', {type: 'button', 'data-key': key, 'aria-pressed': String(pressed), title, onclick: act}, words);
  }
  #field(name, ...content) {
    return make('div', {class: 'field', role: 'group', 'aria-label': name}, make('h3', {}, name), make('div', {class: 'choices'}, ...content));
  }
  #place() {
    const {ear} = this;
    const listeners = this.run.listeners.map((listener, index) => this.#choice(`listener ${index}`, listener.name,
        ear.mode === 'listener' && ear.listener === index, () => ear.setMode('listener', index), 'A listener of the run'));
    return this.#field('Ear',
        this.#choice('camera', 'Camera', ear.mode === 'camera', () => ear.setMode('camera'), 'The ear goes with the view'),
        this.#choice('stay', 'Stays here', ear.mode === 'stay', () => ear.setMode('stay'), 'The ear stays where it is now'), ...listeners);
  }
  #formats() {
    const {ear} = this, own = ear.mode === 'listener';
    const formats = [['mono', 'Mono'], ['pair', 'Pair'], ...(this.hasHead ? [['head', 'Head']] : [])];
    if (own) return this.#field('Format', make('p', {class: 'quiet small'}, `The listener’s own: ${this.run.listeners[ear.listener]?.format ?? 'mono'}`));
    return this.#field('Format', ...formats.map(([format, words]) => this.#choice(format, words, ear.format === format, () => ear.setFormat(format),
        {mono: 'One microphone', pair: 'Two microphones, 17 cm apart', head: 'A measured head: for headphones'}[format])));
  }
  #volume() {
    const words = make('output', {}, this.#decibelText());
    const slider = make('input', {type: 'range', min: -30, max: 40, step: 1, value: this.decibels, 'data-key': 'volume', 'aria-label': 'Volume, dB',
      oninput: () => {
        this.decibels = Number(slider.value);
        words.textContent = this.#decibelText();
        this.does.volume(this.decibels);
      }});
    return this.#field('Volume', slider, words);
  }
  #decibelText() {
    return `${this.decibels > 0 ? '+' : this.decibels < 0 ? '−' : ''}${Math.abs(this.decibels)}\u202fdB`;
  }
  #kinds() {
    return this.#field('Kinds', ...kKinds.map(({name, bit}) =>
        this.#choice(name, name, (this.ear.kinds & bit) !== 0, () => this.ear.toggleKind(bit), `${name}: heard or not`)));
  }

  #bodies() {
    const {bodies} = this.run;
    const list = make('ul', {class: 'bodies'});
    const more = make('p', {class: 'quiet small'});
    const fill = () => {
      const found = bodies.filter((body) => `${body.name} ${body.material ?? ''}`.toLowerCase().includes(this.words.toLowerCase()));
      list.replaceChildren(...found.slice(0, kShown).map((body) => this.#row(body)));
      more.textContent = found.length > kShown ? `${found.length - kShown} more: search for them by name` : '';
    };
    const search = make('input', {type: 'search', placeholder: 'Search bodies', 'aria-label': 'Search bodies', 'data-key': 'search', value: this.words,
      oninput: () => {
        this.words = search.value;
        fill();
      }});
    const silent = this.ear.muted.size + this.ear.solo.size;
    const all = silent ? make('button', {type: 'button', 'data-key': 'all', onclick: () => this.ear.clear()}, 'Hear all') : null;
    fill();
    return make('div', {class: 'field'}, make('div', {class: 'top'}, make('h3', {}, `Bodies (${bodies.length})`), all), bodies.length > 12 ? search : null, list, more);
  }
  #row(body) {
    const {ear} = this;
    const toggle = (set, letter, words) => make('button', {type: 'button', class: 'letter', 'data-key': `${letter}${body.id}`, 'aria-pressed': String(set.has(body.id)),
      'aria-label': `${words} ${body.name}`, title: words, onclick: () => ear.toggle(set, body.id)}, letter);
    return make('li', {class: ear.isAudible(body.id) ? '' : 'silent'},
                make('button', {type: 'button', class: 'row', 'data-key': `body ${body.id}`, onclick: () => this.does.selectBody(body.id)},
                     make('i', {style: `background: ${cssOf(this.looks.get(body.id).lch)}`}), make('span', {class: 'grow'}, body.name),
                     make('span', {class: 'quiet small'}, body.material ?? '')),
                toggle(ear.solo, 'S', 'Solo'), toggle(ear.muted, 'M', 'Mute'));
  }
}
