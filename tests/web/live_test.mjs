// What the page's module makes of a scene beside what `carom render` makes of it: the events.
//
//     live_test.mjs carom_page.wasm carom SCENE FOLDER [SECONDS [ALIKE]]
//
// Runs the scene's first SECONDS, or all of it. Up to ALIKE (s), or the end, each event has to be that of the native
// program: within 1 us in time, and 1e-4 in its impulse. Collisions on Bullet amplify a last digit by some ten each, so two
// machines part after a while. Prints how many events have equal bits, when the first differs by more than the bars, and how
// long the module took. The exit status is 77 if the module was built without the Bullet that the scene wants.
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {basename, join} from 'node:path';

import {CaromModule} from './carom_module.mjs';

const kLate = 1e-6;    // s
const kWeaker = 1e-4;  // of the impulse
const kNumbers = 8;    // of an event
const kPortion = 1 / 60;  // s, as a page asks
const kSkipped = 77;

const [wasm, carom, sceneFile, folder, seconds, alike] = process.argv.slice(2);
mkdirSync(folder, {recursive: true});
const module = new CaromModule(wasm);
const {exports} = module;

/// Opens a scene; an error is the module's sentence.
function open(text) {
  const address = module.copyText(text);
  const live = exports.carom_live_open(address, Buffer.byteLength(text)) >>> 0;
  exports.free(address);
  if (live === 0) throw new Error(module.lastMessage());
  return live;
}

/// The events up to a time, in its order, as rows of numbers.
function eventsOf(live, duration) {
  const most = 4096;
  const numbers = exports.malloc(8 * kNumbers * most) >>> 0;
  const events = [];
  for (let time = 0; time < duration;) {
    time = Math.min(time + kPortion, duration);
    if (exports.carom_live_advance(live, time) !== 0) throw new Error(module.lastMessage());
    for (let count = most; count === most;) {
      count = exports.carom_live_events(live, numbers, most);
      const table = new Float64Array(exports.memory.buffer, numbers, kNumbers * count);
      for (let at = 0; at < table.length; at += kNumbers) events.push([...table.subarray(at, at + kNumbers)]);
    }
  }
  exports.free(numbers);
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
  const columns = ['time_s', 'body', 'other', 'jx_Ns', 'jy_Ns', 'jz_Ns', 'approach_speed_m_s', 'effective_mass_kg'].map(column);
  return cells.map((row) => columns.map((at) => row[at]));
}

function sorted(events) {
  return events.sort((one, other) => one[0] - other[0] || one[1] - other[1] || one[2] - other[2]);
}

const length = (event) => Math.hypot(event[3], event[4], event[5]);

/// Bodies have numbers in the module and names in the table: the first event of each body tells which are one.
class BodyNames {
  names = new Map();
  isOf(number, name) {
    if (!this.names.has(number)) this.names.set(number, name);
    return this.names.get(number) === name;
  }
}

// What is no scene is refused with a sentence, and does not end the module.
for (const bad of ['', '{', '{"a": 1e999}', '[1, 2', '{"bodies": "x"}', '{"duration": 1, "duration": 2}', '\xff\xfe', '[['.repeat(100)]) {
  let message = '';
  try {
    open(bad);
  } catch (error) {
    message = error.message;
  }
  if (!message.startsWith('the scene: ')) throw new Error(`${JSON.stringify(bad)}: ${message}`);
}

const scene = JSON.parse(readFileSync(sceneFile, 'utf8'));
if (seconds !== undefined) scene.duration = Number(seconds);
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
const names = new BodyNames();
const shares = (rows, body) => rows;
let equal = 0, differs = null;
// Shares of one collision have one time, and stand in any order.
const pending = native.map((row) => row.map((cell, at) => (at === 1 || at === 2 ? cell : Number(cell))));
pending.sort((one, other) => one[0] - other[0]);
const indexOf = new Map(scene.bodies.map((body, index) => [body.name, index]));
for (let at = 0; at < Math.max(events.length, pending.length) && differs === null; ++at) {
  const event = events[at];
  // Of the events within the bar in time, the one of the same bodies and impulse.
  const place = event === undefined ? -1 : pending.findIndex((row, index) =>
      index >= at && index < at + 64 && Math.abs(row[0] - event[0]) <= kLate &&
      Math.hypot(row[3] - event[3], row[4] - event[4], row[5] - event[5]) <= kWeaker * length(event) &&
      (!names.names.has(event[1]) || names.names.get(event[1]) === row[1]) &&
      (!names.names.has(event[2]) || names.names.get(event[2]) === row[2]));
  if (place < 0) {
    differs = Math.min(event?.[0] ?? Infinity, pending[at]?.[0] ?? Infinity);
    break;
  }
  const [row] = pending.splice(place, 1);
  pending.splice(at, 0, row);
  names.isOf(event[1], row[1]);
  names.isOf(event[2], row[2]);
  if ([0, 3, 4, 5, 6, 7].every((index) => Object.is(event[index], row[index]))) ++equal;
}
const bar = alike === undefined ? scene.duration : Number(alike);
const isAlike = native.length > 0 && (differs === null || differs > bar);
console.log(`${isAlike ? 'ok' : 'FAILED'} ${basename(sceneFile)}, ${scene.duration} s: ${events.length} events, ${native.length} ` +
            `native ones, ${equal} of equal bits, ` +
            `${differs === null ? 'alike to the end' : `the first that differs is at ${differs.toFixed(6)} s`}; ` +
            `${((user + system) / 1e6).toFixed(2)} s of CPU`);
process.exit(isAlike ? 0 : 1);
