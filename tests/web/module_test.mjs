// Compares what carom.wasm renders with what this machine's library renders of the same calls, and
// tries what the module refuses. Usage: node module_test.mjs MODULE PLAYER FOLDER
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {playInModule} from './call_list.mjs';
import {CaromModule} from './carom_module.mjs';
import {kScenes} from './scenes.mjs';

const kMostDifference = -120;  // dB, of the largest difference to the peak

const [modulePath, player, folder] = process.argv.slice(2);
mkdirSync(folder, {recursive: true});
const files = {model: join(folder, 'block.carom_modes'), head: join(folder, 'head.f64')};

function playNatively(list, name) {
  const calls = join(folder, `${name}.txt`);
  const samples = join(folder, `${name}.f32`);
  writeFileSync(calls, list.text());
  execFileSync(player, ['play', calls, samples]);
  const bytes = readFileSync(samples);
  return new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
}

function peakOf(samples) {
  return samples.reduce((peak, sample) => Math.max(peak, Math.abs(sample)), 0);
}

let failures = 0;
function check(name, action) {
  try {
    console.log('ok     ' + name + (action() ?? ''));
  } catch (error) {
    ++failures;
    console.log(`FAILED ${name}: ${error.message}`);
  }
}

function compare(name, scene) {
  const carom = new CaromModule(modulePath);
  const list = scene(carom.layout, files);
  const native = playNatively(list, name.replaceAll(/\W+/g, '_'));
  const {samples} = playInModule(carom, list);
  assert.equal(samples.length, native.length, 'samples');
  assert.ok(peakOf(native) > 1e-4, `a peak of ${peakOf(native)} Pa is no scene`);
  const difference = peakOf(samples.map((sample, index) => sample - native[index]));
  const level = 20 * Math.log10(difference / peakOf(native));
  assert.ok(level <= kMostDifference, `${level.toFixed(1)} dB from the library`);
  return `: ${level.toFixed(1)} dB from the library, peak ${peakOf(native).toPrecision(3)} Pa`;
}

function playsAlikeTwice() {
  const [first, second] = [0, 1].map(() => {
    const carom = new CaromModule(modulePath);
    return playInModule(carom, kScenes.clicks(carom.layout, files)).samples;
  });
  assert.deepEqual(first, second);
}

/// The fields of each struct fill it, but for what aligns them: none is missing in the table.
function layoutHasNoGaps() {
  const {layout} = new CaromModule(modulePath);
  const bytesOf = {f64: 8, u64: 8, i32: 4, u32: 4};
  for (const [name, {size, fields}] of Object.entries(layout.structs)) {
    let end = 0;
    for (const [field, [offset, kind, count]] of Object.entries(fields)) {
      assert.ok(offset >= end && offset - end < bytesOf[kind], `${name}.${field}`);
      end = offset + count * bytesOf[kind];
    }
    assert.ok(size - end >= 0 && size - end < 8, name);
  }
  assert.ok(Object.keys(layout.structs).length >= 17);
  assert.equal(layout.constants.CAROM_LISTENER_BINAURAL, 3);
}

function importsAndExports() {
  const {module, exports} = new CaromModule(modulePath);
  const imports = WebAssembly.Module.imports(module);
  assert.deepEqual([...new Set(imports.map((each) => each.module))], ['wasi_snapshot_preview1']);
  assert.deepEqual(imports.map((each) => each.name).sort(), [
    'clock_time_get', 'environ_get', 'environ_sizes_get', 'fd_close', 'fd_seek', 'fd_write',
    'proc_exit',
  ]);
  const header = readFileSync(new URL('../../plugin/include/carom/carom.h', import.meta.url), 'utf8');
  for (const [, name] of header.matchAll(/CAROM_API [^;(]*?(carom_\w+)\(/g))
    assert.equal(typeof exports[name], 'function', name);
}

/// Calls that need Bullet, files, a device or a library are refused: the module has none of them.
function refusals() {
  const carom = new CaromModule(modulePath);
  const {exports, layout} = carom;
  const {CAROM_ERROR_ARGUMENT, CAROM_ERROR_KIND, CAROM_ERROR_FILE, CAROM_ERROR_DEVICE} =
      layout.constants;
  const handle = carom.copy(new Uint8Array(4));
  const refused = (wanted, status, word) => {
    assert.equal(status, wanted, carom.lastMessage());
    assert.ok(carom.lastMessage().includes(word), carom.lastMessage());
  };
  const name = carom.copyText('some.file');
  assert.equal(exports.carom_create(0, handle), 0);
  const sound = carom.view().getUint32(handle, true);
  refused(CAROM_ERROR_ARGUMENT, exports.carom_attach(name, 0, handle), 'Bullet');
  refused(CAROM_ERROR_KIND, exports.carom_prepare_bodies(sound), 'carom_attach');
  refused(CAROM_ERROR_DEVICE, exports.carom_play(sound), 'CAROM_DEVICE');
  refused(CAROM_ERROR_FILE, exports.carom_record(sound, carom.copyText('a.wav')), 'a.wav');
  refused(CAROM_ERROR_FILE, exports.carom_load_modes(name, handle), 'no files');
  refused(CAROM_ERROR_FILE, exports.carom_load_normal_map(name, 0, handle), 'reads none');
  refused(CAROM_ERROR_ARGUMENT, exports.carom_read_normal_map(name, 9, name, 0, handle),
          'reads none');
  refused(CAROM_ERROR_ARGUMENT, exports.carom_read_modes(name, 9, name, handle), 'some.file');
  refused(CAROM_ERROR_ARGUMENT, exports.carom_advance(sound, NaN), 'seconds');
  const listener = carom.makeStructs('carom_listener');
  carom.setField('carom_listener', listener, 'format', [layout.constants.CAROM_LISTENER_BINAURAL]);
  const settings = carom.makeStructs('carom_settings');
  carom.setField('carom_settings', settings, 'listeners', [listener]);
  carom.setField('carom_settings', settings, 'listener_count', [1]);
  refused(CAROM_ERROR_ARGUMENT, exports.carom_create(settings, handle), 'CAROM_HRTF');
  assert.equal(exports.carom_bullet_scalar_size(), 0);
  assert.ok(carom.told.some((line) => line.startsWith('carom: ')), 'standard error');
  assert.equal(exports.carom_destroy(sound), 0);
}

/// An instance without memory ends in a trap, and can still tell why.
function lackOfMemory() {
  const carom = new CaromModule(modulePath);
  for (let size = 2 ** 31; size >= 2 ** 16; size /= 2)
    while (carom.exports.malloc(size) !== 0);
  const handle = carom.copy(new Uint8Array(4));
  const settings = carom.makeStructs('carom_settings');
  assert.throws(() => {
    for (;;) assert.equal(carom.exports.carom_create(settings, handle), 0);
  }, WebAssembly.RuntimeError);
  assert.equal(carom.lastMessage(), 'there is no memory left');
}

execFileSync(player, ['model', files.model]);
execFileSync(player, ['head', files.head]);
check('imports are those of docs/web.md, and all of carom.h is exported', importsAndExports);
check('the layout of structs has no gaps', layoutHasNoGaps);
check('what is not in the module is refused', refusals);
check('a lack of memory ends the instance', lackOfMemory);
check('two instances give equal bits', playsAlikeTwice);
for (const [name, scene] of Object.entries(kScenes)) check(name, () => compare(name, scene));
process.exit(failures === 0 ? 0 : 1);
