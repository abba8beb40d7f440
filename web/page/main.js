// The page of a run: reads what is in it, and joins picture, sound, time line and sheets. docs/view.md describes it.
import {Blobs, readManifest} from './run/blobs.js';
import {chosenRuns, chosenTime} from './run/choice.js';
import {readRun} from './run/data.js';
import {Player} from './run/player.js';
import {Ear} from './sound/ear.js';
import {Offline} from './sound/offline.js';
import {Sound} from './sound/sound.js';
import {Stage} from './stage/stage.js';
import {Bar} from './bar/bar.js';
import {startVolume} from './sound/volume.js';
import {View} from './view.js';
import {caromOf} from './carom.js';
import {byId, make} from './text/dom.js';

function fail(error) {
  const failure = byId('failure');
  failure.hidden = false;
  failure.textContent = error.message;
  document.body.classList.add('failed');
}

/// The page cannot draw without WebGL, and says what to do about it.
function makeStage() {
  try {
    return new Stage(byId('view'), byId('labels'), location.search === '?film');
  } catch {
    throw new Error('This browser gives no WebGL 2, which the picture needs. Its settings may have it under "graphics acceleration".');
  }
}

async function open() {
  const manifest = readManifest();
  document.title = `${manifest.title} · Carom`;
  const blobs = new Blobs();
  const head = () => blobs.get(manifest.head);
  const stage = makeStage();
  const runs = await Promise.all(chosenRuns(manifest).map((run, index) => readRun(run, index, blobs)));
  const sound = new Sound(), ear = new Ear();
  const prepared = sound.prepare(runs);
  const player = new Player(runs, sound, ear, head);
  const offline = new Offline(sound, runs, head);
  const bar = new Bar(player, sound, ear);
  const view = new View({manifest, runs, blobs, stage, sound, ear, player, bar, hasHead: manifest.head !== undefined && manifest.head !== null});
  view.begin();
  if (chosenTime()) player.seek(chosenTime());
  await prepared;
  sound.gain = startVolume(runs[0], ear.pose);
  view.gain = sound.gain;
  await view.live.startLinked().catch((error) => view.live.bar.say(error.message));
  view.live.offer();
  view.soundIsKnown();
  return {view, offline, manifest};
}

const opened = open();
window.carom = caromOf(opened);
opened.catch(fail);
