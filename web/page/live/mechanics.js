// The engine's mechanics of one scene (web/live_exports.cpp), in an instance of its own.
import {exportsOf, Instance} from '../sound/instance.js';

/// What it gives as bytes, by number.
const kParts = ['drawing', 'opening', 'sound', 'events', 'poses', 'contacts', 'pictures', 'bodies', 'states', 'file', 'jello'];
const kNext = 1e-9;   // s: as much further is the next frame

/// True if the module can run scenes.
export function runsScenes(module) {
  return module !== null && exportsOf(module, 'carom_live_open');
}

const encoder = new TextEncoder(), decoder = new TextDecoder();

/// Every function that refuses throws an Error with the engine's own sentence.
export class Mechanics extends Instance {
  /// `files` are those that the scene's text names, each {name, bytes}; `sound` are the bytes of a run of the same
  /// scene, which tell how its bodies sound, or null.
  constructor(module, {text, files = []}, sound) {
    super(module);
    this.numbers = this.carom.malloc(24) >>> 0;
    for (const {name, bytes} of files)
      this.with(encoder.encode(`${name}\0`), (path) => this.with(bytes, (at, size) => this.carom.carom_live_hold_file(path, at, size)));
    const json = encoder.encode(text);
    this.live = this.with(json, (at, size) => (sound ? this.with(sound, (known, knownSize) => this.carom.carom_live_open(at, size, known, knownSize))
        : this.carom.carom_live_open(at, size, 0, 0))) >>> 0;
    if (!this.live) throw new Error(this.message());
  }
  /// The text has no file's name in a page.
  message() {
    return super.message().replace(/^(body|scene)\.json: /, '').replace(/^./, (letter) => letter.toUpperCase());
  }
  close() {
    if (this.live) this.carom.carom_live_close(this.live);
    this.live = 0;
  }
  #vector(numbers) {
    new Float64Array(this.carom.memory.buffer, this.numbers, 3).set(numbers);
    return this.numbers;
  }

  /// s: where changes act.
  get head() {
    return this.carom.carom_live_time(this.live);
  }
  /// s: all before is known.
  get settled() {
    return this.carom.carom_live_settled(this.live);
  }
  get portions() {
    return this.carom.carom_live_portions(this.live) >>> 0;
  }
  /// Goes on by one frame.
  advance() {
    this.check(this.carom.carom_live_advance(this.live, this.head + kNext));
  }
  take() {
    this.check(this.carom.carom_live_take(this.live));
  }
  rewind(time) {
    this.check(this.carom.carom_live_rewind(this.live, time));
  }

  /// The bytes of a part where the engine has them: a view that ends with the next call of any function here. Some parts
  /// are taken, the others are made here.
  view(name) {
    const number = kParts.indexOf(name);
    if (['drawing', 'opening', 'states', 'file', 'jello'].includes(name)) this.check(this.carom.carom_live_make(this.live, number));
    return this.#bytes(this.carom.carom_live_part(this.live, number), this.carom.carom_live_part_size(this.live, number));
  }
  /// Views of the numbers of a part.
  doubles(name) {
    const bytes = this.view(name);
    return new Float64Array(bytes.buffer, bytes.byteOffset, bytes.length >> 3);
  }
  floats(name) {
    const bytes = this.view(name);
    return new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length >> 2);
  }
  /// Copies of the bytes of a part and of a blob.
  part(name) {
    return this.view(name).slice();
  }
  blob(number) {
    return this.#bytes(this.carom.carom_live_blob(this.live, number), this.carom.carom_live_blob_size(this.live, number)).slice();
  }
  json(name) {
    return JSON.parse(decoder.decode(this.view(name)));
  }
  #bytes(at, size) {
    return new Uint8Array(this.carom.memory.buffer, at >>> 0, size >>> 0);
  }

  push(body, velocity) {
    this.check(this.carom.carom_live_push(this.live, body, this.#vector(velocity)));
  }
  pull(body, point, place, rate) {
    this.check(this.carom.carom_live_pull(this.live, body, point, this.#vector(place), rate));
  }
  nearestPoint(place) {
    return this.carom.carom_live_nearest_point(this.live, this.#vector(place)) >>> 0;
  }
  release() {
    this.carom.carom_live_release(this.live);
  }
  /// Adds the first body of a scene, and returns its number.
  add(scene) {
    const body = this.with(encoder.encode(JSON.stringify(scene)), (at, size) => this.carom.carom_live_add(this.live, at, size));
    if (body < 0) throw new Error(this.message());
    return body;
  }
  setGravity(vector) {
    this.check(this.carom.carom_live_set_gravity(this.live, this.#vector(vector)));
  }
  setRestitution(value) {
    this.check(this.carom.carom_live_set_restitution(this.live, value));
  }
  setFriction(value) {
    this.check(this.carom.carom_live_set_friction(this.live, value));
  }
  setStepper(isBullet, step) {
    this.check(this.carom.carom_live_set_stepper(this.live, isBullet ? 1 : 0, step));
  }
}
