// The live run of the page: keeps the mechanics a little ahead of what is heard and seen, and lets one meddle with it.
import {beginRun} from './growth.js';
import {sceneText} from './scene_text.js';
import {Journal} from './journal.js';
import {linkOf} from './link.js';
import {Mechanics} from './mechanics.js';

const kBlock = 1024 / 48000;     // s that the sound may render at once
const kBudget = 30;              // ms of mechanics for one picture
const kLeastSlack = 0.03, kMostSlack = 0.35;   // s for pictures that come late
const kPast = 0.4;               // s before the present from which on a change begins anew from there
const kGrow = 100;               // ms between two updates of what the page shows of the run's growth
const kSlow = 0.5, kQuick = 0.1; // shares of pictures that came too late, at which it is said and not any more
const kFirst = 1 / 120;          // s: a frame takes longer
const kRate = 15;                // 1/s, the hand's: how fast a body follows
const kMost = 4e8;               // bytes of a run's sound: with all that goes with them some 1.4 GB
const kFull = 'The run is as long as the page can hold. Rewind it to go on from there, or begin again; it can be kept as a file.';
const kStart = {duration: 1, listeners: [{position: [0, 0, 0]}]};

/// Emits `begin`, `grow` (some more has happened), `bodies` (others are there), `cut` (some was taken back),
/// `state` (slow, past, settings), and `refusal` with a sentence.
export class Live extends EventTarget {
  run = null;
  slow = false;
  past = false;
  over = false;      // the mechanics cannot go on
  most = kMost;      // bytes at which it is not to go on
  #hand = null;
  #late = 0;         // share of pictures for which the mechanics came too late
  #gap = 0;          // s between two pictures, the longest of late
  #last = 0;
  #grown = 0;
  #added = 0;
  #source = null;

  constructor(player, sound) {
    super();
    Object.assign(this, {player, sound});
    player.addEventListener('change', () => this.#tellState());
  }
  #tell(name, more = {}) {
    this.dispatchEvent(Object.assign(new Event(name), more));
  }
  get growth() {
    return this.run?.growth ?? null;
  }
  get running() {
    return this.run !== null && this.player.run === this.run;
  }
  /// s: as far as the mechanics is.
  get head() {
    return this.growth?.head ?? 0;
  }
  get settings() {
    return this.journal.settings;
  }

  /// Begins a scene, given by {text, held, sound, bounds, alone}, in the place of the live run before; if `alone`, of all
  /// runs. `held` is {text, files} of a scene that names files: as the page runs it.
  async begin(source) {
    const {runs} = this.player;
    const mechanics = new Mechanics(this.sound.module, source.held ?? source, source.sound);
    const known = runs.indexOf(this.run), index = source.alone ? 0 : known < 0 ? runs.length : known;
    const run = await beginRun(mechanics, index);
    Object.assign(run, {id: 'live', label: 'live', bounds: source.bounds, open: true});
    this.growth?.mechanics.close();
    this.sound.forget(run);
    if (source.alone) runs.length = 0;
    runs[index] = run;
    Object.assign(this, {run, journal: new Journal(JSON.parse(source.text)), over: false, slow: false});
    this.#source = source;
    this.#hand = null;
    this.#late = this.#added = 0;
    this.#tell('begin');
    this.player.setLoop(null);
    if (this.player.runIndex === index) this.player.renewRun();
    else await this.player.setRun(index);
    this.player.seek(0);
    this.#tellState();
  }
  beginAgain() {
    return this.begin(this.#source);
  }

  /// s that the mechanics has to be ahead of what is rendered, or of what is seen where there is no sound.
  get #lead() {
    const slack = Math.min(kMostSlack, Math.max(kLeastSlack, 1.5 * this.#gap));
    return (this.player.hasSound ? this.growth.ahead + kBlock : 0) + slack;
  }

  /// For each picture: goes on as far as is needed, or as time allows.
  pump(now) {
    const gap = Math.min(1, (now - this.#last) / 1000);
    this.#last = now;
    this.#gap = Math.max(gap, 0.95 * this.#gap);
    if (!this.running) return;
    const {player, growth} = this;
    if (player.playing && !this.over) {
      const from = player.hasSound ? this.sound.renderedTime(player.speed) ?? player.time : player.time;
      const target = from + player.speed * this.#lead;
      const end = performance.now() + kBudget;
      while (this.run.duration < target && !this.over && performance.now() < end) this.#step();
      this.sound.feed(this.run);
      const late = this.run.duration < target - player.speed * Math.min(kLeastSlack, this.#lead / 2);
      this.#late += (late ? 1 - this.#late : -this.#late) * Math.min(1, 2 * gap);
    }
    if (now - this.#grown > kGrow && growth.pieces.length !== this.#shown) this.#tellGrowth(now);
    this.#tellState();
  }
  #shown = 0;
  #step() {
    try {
      if (this.#hand) this.growth.mechanics.pull(this.#hand.body, this.#hand.point, this.#hand.place, kRate);
      if (this.growth.size > this.most) throw new Error(kFull);
      this.growth.advance();
    } catch (error) {
      this.over = true;
      this.refuse(error);
    }
  }
  #tellGrowth(now = performance.now()) {
    this.#grown = now;
    this.#shown = this.growth.pieces.length;
    this.#tell('grow');
  }
  #tellState() {
    if (!this.run) return;
    const {player} = this;
    const slow = this.running && player.playing && this.#late > (this.slow ? kQuick : kSlow);
    const past = this.running && this.head - player.time > this.#lead * player.speed + kPast;
    if (slow === this.slow && past === this.past && player.playing === this.playing) return;
    Object.assign(this, {slow, past, playing: player.playing});
    this.#tell('state');
  }
  refuse(error) {
    this.#tell('refusal', {words: error.message});
  }

  /// Goes on by some seconds at once.
  advance(seconds) {
    const end = this.head + seconds;
    while (this.head < end - 1e-9 && !this.over) this.#step();
    this.sound.feed(this.run);
    this.#tellGrowth();
    this.#tellState();
  }

  /// Takes back all after a time (s), and shows that time.
  rewind(time) {
    const {growth, run, player} = this;
    if (!this.running) player.setRun(run.index);
    const bodies = run.bodies.length;
    const portions = growth.rewind(Math.max(0, time));
    this.over = false;
    this.sound.cut(run, portions);
    this.sound.feed(run);
    this.journal.keep(this.head);
    this.#tell('cut', {time: this.head});
    if (run.bodies.length !== bodies) this.#tell('bodies');
    player.seek(Math.min(this.head, run.duration));
    this.#tellGrowth();
    this.#tell('state');
  }
  goOn() {
    if (this.past) this.rewind(this.player.time);
    return this.player.playing ? undefined : this.player.play();
  }
  /// Takes back the latest change, and what came of it.
  takeBack() {
    const {latest} = this.journal;
    if (latest === null) return undefined;
    if (latest < kFirst) return this.beginAgain();
    return this.rewind(latest - kFirst);
  }

  /// Changes act at the head, a moment ahead of what is seen; where time stands, or far from the head, at the time
  /// that is seen, and what came after it is taken back.
  #toPresent() {
    if (!this.running) this.player.setRun(this.run.index);
    const {player, head} = this, behind = head - player.time;
    if (player.playing ? behind > this.#lead * player.speed + kPast : behind > 1e-9) this.rewind(player.time);
  }

  /// Adds a body: {shape: 'sphere' or 'box', size: m across, material, position, velocity}. Returns its number.
  throw({shape = 'sphere', size = 0.02, material = 'steel', position, velocity = [0, 0, 0]}) {
    this.#toPresent();
    const {scene, settings} = this.journal, onBullet = settings.stepper === 'bullet';
    const body = {type: 'sphere', name: this.#nameFor(`${material.replaceAll('_', ' ')} ${shape === 'box' ? 'box' : 'ball'}`), radius: size / 2,
                  material, position: [...position], velocity: [...velocity]};
    if (shape === 'box') {
      delete body.radius;
      Object.assign(body, {type: 'solid', shape: {type: 'box', half_extents: [size / 2, size / 2, size / 2]}});
    }
    if (settings.friction !== undefined) body.friction = settings.friction;
    let {materials} = scene;
    if (settings.restitution !== undefined) {
      body.material = `${material} (live)`;
      materials = {...materials, [body.material]: {like: material, restitution: settings.restitution}};
    }
    const id = this.growth.add({...kStart, ...(onBullet ? {stepper: {type: 'bullet'}} : {}), ...(materials ? {materials} : {}), bodies: [body]});
    this.journal.note({time: this.head, body, id, materials});
    this.sound.feed(this.run);
    this.#tell('bodies');
    return id;
  }
  #nameFor(kind) {
    const names = new Set(this.run.bodies.map((body) => body.name));
    do ++this.#added; while (names.has(`${kind} ${this.#added}`));
    return `${kind} ${this.#added}`;
  }

  /// Changes the velocity of a body (m/s).
  push(body, velocity) {
    this.#toPresent();
    this.growth.mechanics.push(body, velocity);
  }
  /// Draws a body towards a place until `release`; of a jello the point that was nearest to `grip` at first.
  pull(body, place, grip = place) {
    if (this.#hand?.body !== body) {
      this.#toPresent();
      const soft = body === this.run.jello?.body;
      this.#hand = {body, point: soft ? this.growth.mechanics.nearestPoint(grip) : 0};
    }
    this.#hand.place = [...place];
    this.growth.mechanics.pull(body, this.#hand.point, this.#hand.place, kRate);
  }
  release() {
    this.#hand = null;
    this.growth?.mechanics.release();
  }
  get pulled() {
    return this.#hand?.body ?? null;
  }

  /// Settings from now on: gravity (m/s^2, along the scene's own direction, or a vector), restitution, friction,
  /// stepper ('native' or 'bullet') and step (s).
  set({gravity, restitution, friction, stepper, step}) {
    this.#toPresent();
    const {mechanics} = this.growth, {settings} = this;
    const note = (set) => this.journal.note({time: this.head, set});
    if (gravity !== undefined) {
      const vector = Array.isArray(gravity) ? gravity : this.gravityWay.map((part) => part * gravity);
      mechanics.setGravity(vector);
      note({gravity: vector});
    }
    if (restitution !== undefined) {
      mechanics.setRestitution(restitution);
      note({restitution});
    }
    if (friction !== undefined) {
      mechanics.setFriction(friction);
      note({friction});
    }
    if (stepper !== undefined || step !== undefined) {
      const chosen = {stepper: stepper ?? settings.stepper, step: step ?? settings.step};
      mechanics.setStepper(chosen.stepper === 'bullet', chosen.step);
      note(chosen);
    }
    this.#tell('state');
  }
  /// The direction of the scene's own gravity; downwards if it has none.
  get gravityWay() {
    const [x, y, z] = this.journal.scene.gravity ?? [0, -9.81, 0], size = Math.hypot(x, y, z);
    return size > 0 ? [x / size, y / size, z / size] : [0, -1, 0];
  }

  /// The scene as it is at the head.
  sceneJson() {
    const {mechanics} = this.growth;
    return sceneText(this.journal, this.run, {states: mechanics.doubles('states').slice(), time: this.head,
                                              jello: this.run.jello ? mechanics.doubles('jello') : null});
  }
  link() {
    if (this.#source.held) throw new Error('A link holds no files, and this scene names some. Copy the scene instead, into its folder.');
    return linkOf(this.sceneJson());
  }
  runFile() {
    return this.growth.mechanics.part('file');
  }
}
