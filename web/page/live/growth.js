// A run that goes on: the mechanics' frames as they come, in the form in which the page draws and hears any run.
import {readRun} from '../run/data.js';
import {ContactList} from '../run/contacts.js';
import {EventList} from '../run/events.js';
import {Growing, GrowingTracks} from './growing.js';

const kAhead = 0.101;        // s of the run that the sound wants to know beyond what it renders,
const kJelloAhead = 0.05;    // and more where something deforms

/// Begins a run of the page whose `growth` is what has come of it. It has one frame already, as a
/// jello is nowhere before its first picture.
export async function beginRun(mechanics, index) {
  const drawing = mechanics.json('drawing');
  const blobs = {get: async (number) => (number === undefined || number === null ? null : mechanics.blob(number)), joined: async () => opening};
  const opening = mechanics.part('opening');
  const run = await readRun({...drawing, sound: 0}, index, blobs);
  run.growth = new Growth(mechanics, run);
  run.growth.advance();
  return run;
}

class Growth {
  pieces = [];   // frames: {sound: bytes, portions, told: rows of events, pictures}, up to the end of each
  cuts = 0;      // how often some were taken back
  size = 0;      // bytes of all their sound; mechanics and engine have about as much of it, each
  #list = new EventList();
  #contacts = new ContactList();
  #times = new Growing(Float64Array);
  #places = new Growing(Float32Array);

  constructor(mechanics, run) {
    Object.assign(this, {mechanics, run, ahead: kAhead + (run.jello ? kJelloAhead : 0)});
    Object.assign(run, {events: this.#list.events, contacts: this.#contacts.contacts, tracks: new GrowingTracks(run.bodies)});
    // The first take has the bodies that the drawing has.
    this.#take();
  }
  get head() {
    return this.mechanics.head;
  }

  /// Goes on by a frame.
  advance() {
    this.mechanics.advance();
    this.#take();
  }
  /// Adds a body to the mechanics; returns its number.
  add(scene) {
    const body = this.mechanics.add(scene);
    this.#take();
    return body;
  }

  #take() {
    const {mechanics, run} = this;
    mechanics.take();
    const sound = mechanics.part('sound');
    this.#list.add(mechanics.doubles('events'));
    this.#contacts.add(mechanics.doubles('contacts'));
    run.tracks.add(mechanics.floats('poses'));
    this.#addBodies(mechanics.json('bodies'));
    if (run.jello) this.#addPictures(mechanics.view('pictures'));
    run.duration = mechanics.settled;
    this.size += sound.length;
    this.pieces.push({sound, portions: mechanics.portions, told: this.#list.told, pictures: this.#times.count});
  }
  #addBodies(bodies) {
    const {run} = this, born = this.head;
    const added = bodies.filter((body) => !run.byId.has(body.id)).map((body) => ({...body, name: body.name || `body ${body.id}`, born}));
    if (!added.length) return;
    run.bodies.push(...added);
    for (const body of added) run.byId.set(body.id, body);
    run.tracks.addBodies(added);
  }
  #addPictures(bytes) {
    const width = 8 + 12 * this.run.jello.points, view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
    for (let at = 0; at + width <= bytes.length; at += width) {
      this.#times.add([view.getFloat64(at, true)]);
      this.#places.add(new Float32Array(bytes.slice(at + 8, at + width).buffer));
    }
    this.#showPictures();
  }
  #showPictures() {
    Object.assign(this.run.jello, {times: this.#times.numbers, positions: this.#places.numbers});
  }

  /// Takes back all that happened since the last frame that ended at `time` (s) or before; returns
  /// how many portions stay.
  rewind(time) {
    const {mechanics, run} = this;
    mechanics.rewind(time);
    const {portions} = mechanics, head = mechanics.head;
    const stay = this.pieces.findLastIndex((piece) => piece.portions <= portions) + 1;
    this.pieces.length = stay;
    this.size = this.pieces.reduce((size, {sound}) => size + sound.length, 0);
    ++this.cuts;
    const last = this.pieces[stay - 1];
    this.#list.keep(last.told);
    this.#contacts.keep(head);
    const bodies = run.bodies.filter((body) => !(body.born > head + 1e-9));
    const gone = run.bodies.length - bodies.length;
    if (gone) {
      run.bodies.splice(0, Infinity, ...bodies);
      run.byId.clear();
      for (const body of bodies) run.byId.set(body.id, body);
    }
    run.tracks.keep(head, run.byId);
    if (run.jello) {
      this.#times.keep(last.pictures);
      this.#places.keep(3 * run.jello.points * last.pictures);
      this.#showPictures();
    }
    run.duration = mechanics.settled;
    if (run.jello && last.pictures === 0) this.advance();
    return portions;
  }
}
