// What the page's module makes of a scene beside what `carom render` makes of it: the events.
//
//     live_test.mjs carom_page.wasm carom SCENE FOLDER [SECONDS [STEPPER [ALIKE]]]
//
// Runs the scene's first SECONDS, or all of it, on its stepper or STEPPER at its default step. Up to ALIKE (s), or the end, each event has to be that of the native
// program: within 1 us in time, and 1e-4 in its impulse. Collisions on Bullet amplify a last digit by some ten each, so two
// machines part after a while. Prints how many events have equal bits, when the first differs by more than the bars, and how
// long the module took. The exit status is 77 if the module was built without the Bullet that the scene wants.
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {basename, join} from 'node:path';

import {CaromModule} from './carom_module.mjs';

const kLate = 1e-6;    // s
const kWeaker = 1e-4;  // of the impulse
const kEvents = 3;     // the part that has events
const kNumbers = 14;   // of an event
const kPortion = 1 / 60;  // s, as a page asks
const kSkipped = 77;

const [wasm, carom, sceneFile, folder, seconds, stepper, alike] = process.argv.slice(2);
mkdirSync(folder, {recursive: true});
const module = new CaromModule(wasm);
const {exports} = module;

/// Opens a scene; an error is the module's sentence.
function open(text) {
  const address = module.copyText(text);
  const live = exports.carom_live_open(address, Buffer.byteLength(text), 0, 0) >>> 0;
  exports.free(address);
  if (live === 0) throw new Error(module.lastMessage());
  return live;
}

/// The events up to a time, in its order, as rows of numbers: time, bodies, impulse, approach speed.
function eventsOf(live, duration) {
  const events = [];
  for (let time = 0; time < duration;) {
    time = Math.min(time + kPortion, duration);
    if (exports.carom_live_advance(live, time) !== 0) throw new Error(module.lastMessage());
    if (exports.carom_live_take(live) !== 0) throw new Error(module.lastMessage());
    const bytes = exports.carom_live_part(live, kEvents) >>> 0, size = exports.carom_live_part_size(live, kEvents) >>> 0;
    const table = new Float64Array(exports.memory.buffer.slice(bytes, bytes + size));
    for (let at = 0; at < table.length; at += kNumbers) {
      const row = table.subarray(at, at + kNumbers);
      events.push([row[0], row[1], row[2], row[10], row[11], row[12], row[4]]);
    }
  }
  return sorted(events.filter(([time]) => time <= duration));
}

/// The rows of `carom render --events` as those of the module.
function nativeEvents(text) {
  const scene = join(folder, 'scene.json'), table = join(folder, 'events.csv');
  writeFileSync(scene, text);
  execFileSync(carom, ['render', scene, '-o', join(folder, 'sound.wav'), '--events', table]);
  const rows = readFileSync(table, 'utf8').trim().split('\n').map((line) => line.split(','));
  const [names, ...cells] = rows;
  const column = (name) => names.indexOf(name);
  const columns = ['time_s', 'body', 'other', 'jx_Ns', 'jy_Ns', 'jz_Ns', 'approach_speed_m_s'].map(column);
  const isName = (index) => index === 1 || index === 2;
  return sorted(cells.map((row) => columns.map((at, index) => isName(index) ? row[at] : Number(row[at]))));
}

function sorted(events) {
  return events.sort((one, other) => one[0] - other[0]);
}

const length = (event) => Math.hypot(event[3], event[4], event[5]);

/// Bodies have numbers in the module and names in the table: the first event of each tells which are one.
class BodyNames {
  names = new Map();
  mayBe(number, name) {
    return !this.names.has(number) || this.names.get(number) === name;
  }
  mark(number, name) {
    this.names.set(number, name);
  }
}

/// Compares events in order of time. Shares of one collision have one time, and stand in any order, as may whatever happens
/// within the bar: so each event looks for its partner among the next ones.
function compare(events, native) {
  const kNear = 64;
  const names = new BodyNames();
  const left = [...native];
  let equal = 0;
  for (const event of events) {
    const isPartner = (row) => Math.abs(row[0] - event[0]) <= kLate &&
        Math.hypot(row[3] - event[3], row[4] - event[4], row[5] - event[5]) <= kWeaker * length(event) &&
        names.mayBe(event[1], row[1]) && names.mayBe(event[2], row[2]);
    const place = left.slice(0, kNear).findIndex(isPartner);
    if (place < 0) return {equal, differs: Math.min(event[0], left[0]?.[0] ?? Infinity)};
    const [row] = left.splice(place, 1);
    names.mark(event[1], row[1]);
    names.mark(event[2], row[2]);
    if ([0, 3, 4, 5, 6].every((index) => Object.is(event[index], row[index]))) ++equal;
  }
  return {equal, differs: left[0]?.[0]};
}

// What is no scene is refused with a sentence, and does not end the module.
for (const bad of ['', '{', '{"a": 1e999}', '[1, 2', '{"bodies": "x"}', '{"duration": 1, "duration": 2}', '\xff\xfe', '[['.repeat(100)]) {
  let message = '';
  try {
    open(bad);
  } catch (error) {
    message = error.message;
  }
  if (!message.startsWith('scene.json: ')) throw new Error(`${JSON.stringify(bad)}: ${message}`);
}

/// A tetrahedron as a PLY file.
const kMesh = `ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z
element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1
3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n`;

/// Files that a scene names are those that the module was given, by their names.
function testHeldFiles() {
  const text = JSON.stringify({
    duration: 1, stepper: {type: 'bullet'},
    bodies: [{type: 'solid', material: 'steel', position: [0, 1, 0], shape: {type: 'mesh', file: 'meshes/one.ply'}}],
    listeners: [{position: [0, 0, 1]}],
  });
  const attempt = () => {
    try {
      exports.carom_live_close(open(text));
      return '';
    } catch (error) {
      return error.message;
    }
  };
  const without = attempt();
  if (!without.includes('there is no file "meshes/one.ply"')) throw new Error(`without the file: ${without}`);
  const name = module.copyText('meshes/one.ply'), bytes = module.copyText(kMesh);
  exports.carom_live_hold_file(name, bytes, kMesh.length);
  [name, bytes].forEach((address) => exports.free(address));
  const refused = attempt();
  if (refused !== '' && !refused.includes('has no Bullet')) throw new Error(`with the file: ${refused}`);
}
testHeldFiles();

const scene = JSON.parse(readFileSync(sceneFile, 'utf8'));
if (seconds !== undefined) scene.duration = Number(seconds);
if (stepper !== undefined) scene.stepper = {type: stepper};
const text = JSON.stringify(scene);
let live;
try {
  live = open(text);
} catch (error) {
  if (!/has no Bullet/.test(error.message)) throw error;
  console.log(`skipped: ${error.message}`);
  process.exit(kSkipped);
}
const before = process.cpuUsage();
const events = eventsOf(live, scene.duration);
const {user, system} = process.cpuUsage(before);
exports.carom_live_close(live);

const native = nativeEvents(text);
const {equal, differs} = compare(events, native);
const bar = alike === undefined ? scene.duration : Number(alike);
const isAlike = native.length > 0 && (differs === undefined || differs > bar);
console.log(`${isAlike ? 'ok' : 'FAILED'} ${basename(sceneFile)}, ${scene.duration} s: ${events.length} events, ${native.length} ` +
            `native ones, ${equal} of equal bits, ` +
            `${differs === undefined ? 'alike to the end' : `the first that differs is at ${differs.toFixed(6)} s`}; ` +
            `${((user + system) / 1e6).toFixed(2)} s of CPU`);
process.exit(isAlike ? 0 : 1);
