// What is selected: an event, who hit whom and how; or a body, and its events.
import {cssOf} from '../stage/colours.js';
import {sidesOf} from '../run/data.js';
import {byId, decibelWords, icon, make, microseconds, quantity, setIcon} from './dom.js';

const kListed = 6;   // events of a body that are shown

export class Panel {
  /// `does` has select(event), selectBody(id), alone(event), step(way, body), close().
  constructor(ear, does) {
    Object.assign(this, {ear, does, element: byId('panel')});
    ear.addEventListener('change', () => this.body !== undefined && this.showBody(this.run, this.looks, this.body));
  }

  hide() {
    this.body = undefined;
    this.element.hidden = true;
  }
  #fill(title, ...content) {
    const close = make('button', {type: 'button', class: 'close', 'aria-label': 'Close', onclick: () => this.does.close()});
    setIcon(close, 'close');
    this.element.replaceChildren(make('div', {class: 'top'}, make('h2', {}, ...title), close), ...content);
    this.element.hidden = false;
  }
  #chip(run, looks, id) {
    const body = run.byId.get(id);
    if (!body) return make('span', {class: 'chip plain'}, 'the world');
    return make('button', {type: 'button', class: 'chip', title: `${body.name}, ${body.material ?? 'of no material'}`, onclick: () => this.does.selectBody(id)},
                make('i', {style: `background: ${cssOf(looks.get(id).lch)}`}), body.name);
  }
  #facts(facts) {
    return make('dl', {}, ...facts.filter(Boolean).flatMap(([name, value, unit]) =>
        [make('dt', {}, name), make('dd', {}, value, unit ? make('small', {}, ` ${unit}`) : null)]));
  }

  showEvent(run, looks, event, sounds) {
    this.body = undefined;
    const [one, two] = sidesOf(run, event);
    const title = [this.#chip(run, looks, one), make('span', {class: 'quiet'}, ' hits '), this.#chip(run, looks, two)];
    const alone = make('button', {type: 'button', class: 'strong', disabled: !sounds, onclick: () => this.does.alone(event)}, 'Its sound alone');
    alone.prepend(icon('play'));
    this.#fill(title, this.#facts([
      ['Time', microseconds(event.time)],
      ['Loudness', decibelWords(event.level), 'peak, re 20 µPa'],
      ['Approach', quantity(event.approachSpeed, 'm/s')],
      ['Impulse', quantity(event.impulse, 'N s')],
      event.duration > 0 ? ['Contact', quantity(event.duration, 's')] : null,
    ]), make('div', {class: 'acts'}, alone, this.#steps(null)),
    make('p', {class: 'quiet small'}, `Event ${event.index + 1} of ${run.events.length}`));
  }
  #steps(body) {
    const step = (name, words, way) => {
      const button = make('button', {type: 'button', 'aria-label': words, title: words, onclick: () => this.does.step(way, body)});
      setIcon(button, name);
      return button;
    };
    return make('span', {class: 'group'}, step('previous', 'Previous event', -1), step('next', 'Next event', 1));
  }

  showBody(run, looks, id) {
    const body = run.byId.get(id);
    if (!body) return;
    Object.assign(this, {run, looks, body: id});
    const mine = run.events.filter((event) => event.body === id || event.other === id);
    const title = [make('span', {class: 'chip plain'}, make('i', {style: `background: ${cssOf(looks.get(id).lch)}`}), body.name)];
    const toggle = (set, words) => make('button', {type: 'button', 'aria-pressed': String(set.has(id)), onclick: () => this.ear.toggle(set, id)}, words);
    this.#fill(title, this.#facts([
      ['Material', body.material ?? '–'],
      ['Mass', body.mass === null || body.mass === undefined ? 'immovable' : quantity(body.mass, 'kg')],
      body.radius ? ['Radius', quantity(body.radius, 'm')] : null,
      ['Events', String(mine.length)],
      body.rings ? ['Sound', 'clicks, and rings'] : null,
    ]), make('div', {class: 'acts'}, toggle(this.ear.solo, 'Solo'), toggle(this.ear.muted, 'Mute'), mine.length ? this.#steps(id) : null),
    mine.length ? this.#loudest(run, mine, id) : null);
  }
  #loudest(run, events, id) {
    const loud = [...events].sort((a, b) => b.level - a.level).slice(0, kListed).sort((a, b) => a.time - b.time);
    const rows = loud.map((event) => {
      const other = event.body === id ? event.other : event.body;
      return make('li', {}, make('button', {type: 'button', class: 'row', onclick: () => this.does.select(event)},
                  make('span', {}, microseconds(event.time)), make('span', {class: 'grow'}, run.byId.get(other)?.name ?? 'the world'),
                  make('span', {}, decibelWords(event.level))));
    });
    return make('div', {class: 'list'}, make('h3', {}, events.length > kListed ? 'Its loudest events' : 'Its events'), make('ul', {}, ...rows));
  }
}
