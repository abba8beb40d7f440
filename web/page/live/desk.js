// The live run as the page offers it: how it starts, what the pointer and keys do, and what the page shows of it.
import {linkedScene} from './link.js';
import {Gestures} from './gestures.js';
import {kLeastSize, kMostSize} from './limits.js';
import {Live} from './live.js';
import {LiveBar} from './live_bar.js';
import {LiveSheet} from './live_sheet.js';
import {Mechanics, runsScenes} from './mechanics.js';
import {beginRun} from './growth.js';
import {Keep} from './keep.js';
import {pointedAt, keptInside, throwFrom} from './aim.js';
import {startVolume} from '../sound/volume.js';
import {byId} from '../text/dom.js';

const kPreview = 2, kPreviewWork = 400;   // s of a linked scene that frame the picture, and ms that they may take
const kHigh = 0.3;                        // radii of the scene, from what is pointed at to what drops there
const kTries = 4;                         // places, one above the other, at which a body may drop

const clamp = (value, least, most) => Math.min(most, Math.max(least, value));

export class Desk {
  tool = 'hand';     // or 'throw', 'drop'
  choice = {shape: 'sphere', size: 0.02, material: 'steel', speed: 3};

  constructor(view, blobs) {
    const {player, sound, stage} = view;
    Object.assign(this, {view, blobs, stage, player, sound, live: new Live(player, sound)});
    this.gestures = new Gestures(stage, this.live, {
      press: (x, y) => this.#press(x, y), pullable: (body) => this.#isPullable(body), select: (body) => view.selectBody(body),
      middle: (body) => this.middleOf(body),
      pull: (body, place, grip, to) => this.try(() => this.#pull(body, place, grip, to)), release: () => this.#release(),
    });
    this.keep = new Keep(this);
    this.sheet = new LiveSheet(this);
    this.bar = new LiveBar(this);
    this.#listen();
  }
  #listen() {
    const {live, view, stage, bar} = this;
    live.addEventListener('begin', () => view.offerRuns());
    live.addEventListener('grow', () => this.#showGrowth());
    live.addEventListener('bodies', () => this.#showBodies());
    live.addEventListener('cut', ({time}) => this.#forget(time));
    live.addEventListener('state', () => this.#showState());
    live.addEventListener('refusal', ({words}) => bar.say(words));
    this.player.addEventListener('change', () => this.#showState());
    byId('begin-live').onclick = byId('play-with-it').onclick = () => this.play();
    addEventListener('hashchange', () => /[#&]scene=/.test(location.hash) && location.reload());
    stage.canvas.addEventListener('lostpointercapture', () => this.#release());
  }

  /// Shows that there is a live run to be had, once the engine is known.
  offer() {
    const run = this.player.runs.find((item) => item.scene !== undefined || item.notLive);
    this.offers = runsScenes(this.sound.module) && (run !== undefined || this.live.run !== null);
    byId('begin-live').hidden = !this.offers || run?.notLive !== undefined || this.live.run !== null;
    byId('play-with-it').hidden = !this.offers;
    this.view.offerRuns();
  }
  async #sourceOf(run) {
    if (!runsScenes(this.sound.module)) throw new Error('The engine of this page runs no scenes.');
    if (run.notLive) throw new Error(run.notLive);
    if (run.scene === undefined) throw new Error('This page has no scene to play with.');
    const textOf = async (blob) => new TextDecoder().decode(await this.blobs.get(blob));
    const source = {text: await textOf(run.scene), sound: run.hasSound ? await run.soundBytes() : null, bounds: this.stage.boundsFor(run)};
    if (run.held) {
      source.held = {text: await textOf(run.held.scene), files: []};
      for (const {name, blob} of run.held.files) source.held.files.push({name, bytes: await this.blobs.get(blob)});
    }
    return source;
  }
  /// Begins the scene of the run that is shown, or shows the live run that is there already.
  async start() {
    const {live, player} = this;
    if (live.run && !live.running) return player.setRun(live.run.index);
    if (live.running) return live.beginAgain();
    await live.begin(await this.#sourceOf(player.run));
    return this.#choose();
  }
  /// What the button does: begins, or goes on from what is seen.
  async play() {
    const {live, player} = this;
    try {
      if (live.running) return await live.goOn();
      await this.start();
      if (!player.playing) await player.play();
    } catch (error) {
      this.bar.say(error.message);
    }
    return undefined;
  }

  /// Begins the scene that the address has; true if it has one.
  async startLinked() {
    const text = await linkedScene();
    if (text === null) return false;
    if (!runsScenes(this.sound.module)) throw new Error('The engine of this page runs no scenes.');
    const {view, live, stage} = this, preview = await this.#preview(text);
    await live.begin({text, sound: null, bounds: stage.boundsFor(preview), alone: true});
    const {name} = JSON.parse(text);
    view.setTitle(name || 'A scene');
    view.showAll();
    view.ear.pose = stage.cameraPose();
    view.gain = this.sound.gain = startVolume(preview, view.ear.pose);
    this.#choose();
    return true;
  }
  /// The beginning of a scene, run ahead, which tells where it takes place and how loud it is.
  async #preview(text) {
    const mechanics = new Mechanics(this.sound.module, {text}, null), run = await beginRun(mechanics, 0);
    const end = performance.now() + kPreviewWork;
    while (run.growth.head < kPreview && performance.now() < end) run.growth.advance();
    mechanics.close();
    return run;
  }
  /// A body like those of the scene, thrown so that it crosses the picture in about half a second.
  #choose() {
    const {radius} = this.stage.bounds;
    const sizes = this.live.run.bodies.filter((body) => body.moves && body.form.kind === 'sphere').map((body) => 2 * body.form.radius).sort((a, b) => a - b);
    this.choice.size = clamp(sizes[sizes.length >> 1] ?? 0.12 * radius, kLeastSize, kMostSize);
    this.choice.speed = clamp(Number((3 * radius / 0.4).toPrecision(1)), 1, 12);
    this.sheet.show();
    this.#showState();
  }

  /// Does something that the engine may refuse, and says what it says.
  try(act) {
    try {
      return act();
    } catch (error) {
      this.bar.say(error.message);
      this.sheet.show();
      return undefined;
    }
  }
  #isPullable(body) {
    const {run} = this.player;
    return run.byId.get(body)?.moves || body === run.jello?.body;
  }
  /// The place of a body now; of a jello that of its drawn points in the mean.
  middleOf(body) {
    const {run, time} = this.player;
    if (body !== run.jello?.body) return run.tracks.pose(body, time, new Array(7)).slice(0, 3);
    this.stage.jello.update(time);
    return this.stage.jello.middle();
  }
  #pull(body, place, grip, to) {
    if (!this.player.playing && this.live.pulled === null) this.player.play();
    this.live.pull(body, place, grip);
    this.held = {body, offset: to.map((part, axis) => part - place[axis]), to};
    this.view.touch();
  }
  #release() {
    if (!this.held) return;
    this.held = null;
    this.live.release();
    this.view.touch();
  }
  #press(x, y) {
    if (this.tool === 'hand') return false;
    if (this.tool === 'throw') this.throwAt(x, y); else this.dropAt(x, y);
    return true;
  }
  /// Where the pointer is, or else the middle of the picture.
  #pointer() {
    const {gestures, stage} = this;
    return gestures.x === null ? stage.project(stage.bounds.centre.toArray()).slice(0, 2) : [gestures.x, gestures.y];
  }
  throwAt(x, y) {
    if (!this.live.running) return;
    [x, y] = x === undefined ? this.#pointer() : [x, y];
    const {stage, choice} = this, ray = stage.ray(x, y);
    this.try(() => this.live.throw({...choice, position: throwFrom(stage, ray, this.#reach).toArray(),
                                    velocity: ray.direction.clone().multiplyScalar(choice.speed).toArray()}));
  }
  dropAt(x, y) {
    if (!this.live.running) return;
    [x, y] = x === undefined ? this.#pointer() : [x, y];
    const {stage, choice} = this, height = 1.1 * this.#reach + kHigh * stage.bounds.radius;
    const place = pointedAt(stage, x, y).addScaledVector(stage.up, height);
    this.try(() => this.#drop(keptInside(stage, place, this.#reach), choice));
  }
  /// Where a body is in the way there is room above it.
  #drop(place, choice) {
    for (let round = 1; ; ++round) {
      try {
        return this.live.throw({...choice, position: place.toArray()});
      } catch (error) {
        if (round === kTries) throw error;
        place.addScaledVector(this.stage.up, 2.2 * this.#reach);
      }
    }
  }
  /// m from the middle of the chosen body to its farthest point.
  get #reach() {
    return this.choice.size / 2 * (this.choice.shape === 'box' ? Math.sqrt(3) : 1);
  }
  /// Gives the selected body, or the one under the pointer, a push away from the eye.
  push() {
    const {live, view, stage} = this;
    if (!live.running) return;
    const body = view.body ?? stage.pick(...this.#pointer());
    if (body === null || !this.#isPullable(body)) return this.bar.say('Point to a body that moves, or select one (N), to push it.');
    const {direction} = stage.ray(...stage.project(live.run.tracks.pose(body, this.player.time, new Array(7))));
    return this.try(() => live.push(body, direction.multiplyScalar(this.choice.speed).toArray()));
  }
  setTool(tool) {
    this.tool = tool;
    this.bar.show();
  }
  nextTool() {
    const tools = ['hand', 'throw', 'drop'];
    if (this.live.running) this.setTool(tools[(tools.indexOf(this.tool) + 1) % tools.length]);
  }

  /// Before each picture.
  pump(now) {
    this.live.pump(now);
    const {held, stage, player} = this;
    if (!held || !this.live.running) return stage.hand.show(null);
    const soft = held.body === player.run.jello?.body;
    const from = soft ? stage.jello.nearest(held.to) : this.middleOf(held.body).map((part, axis) => part + held.offset[axis]);
    return stage.hand.show(from, held.to);
  }
  #showGrowth() {
    if (!this.live.running || this.view.shown !== this.live.run) return;
    this.stage.impacts.measure();
    this.view.bar.grow();
    this.view.touch();
  }
  #showBodies() {
    if (this.view.shown !== this.live.run) return;
    this.stage.showBodies();
    this.view.bar.recolour();
    this.view.mixer.show(this.live.run, this.stage.looks);
    if (this.view.body !== null && !this.live.run.byId.has(this.view.body)) this.view.close();
    this.view.touch();
  }
  #forget(time) {
    this.view.bar.spectrogram.forget(time);
    if (this.view.selected?.time > time) this.view.close();
    if (this.player.loop?.[1] > time) this.player.setLoop(null);
    if (this.held) this.#release();
  }
  #showState() {
    if (!this.live.running && this.held) this.#release();
    this.bar.show();
    this.sheet.show();
  }
}
