// What the module plays of a run beside what `carom replay` renders of it, for three ears.
//
//     run_test.mjs carom.wasm carom SCENE FOLDER [slides]
//
// With `slides`, levels are compared in place of samples: bumps that bounce on one another make of a
// last digit, which two C libraries do not share, another sound within a tenth of a second.
//
// The page of `carom view` is made with a template that holds nothing but its mark, and the bytes of
// the run are taken from it. Prints a line for each ear; the exit status is 1 if one is not alike.
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {basename, join} from 'node:path';
import {gunzipSync} from 'node:zlib';

import {CaromModule} from './carom_module.mjs';

const kAlike = -120;  // dB of the peak
const kAlikeLevel = 1;  // dB
const kFade = 0.1;      // s: the last of a jello, which `carom replay` fades
const kFrames = 1024;
const kEars = [[0.3, 0.4, 0.9], [-1.5, 0.8, -0.7], [0, 3, 0.1]];

const [wasm, carom, scene, folder, kind] = process.argv.slice(2);
mkdirSync(folder, {recursive: true});
const fileIn = (name) => join(folder, name);

/// The samples (Pa) of a float WAV file of one channel, whose full scale is 1 Pa.
function samplesOf(file) {
  const bytes = readFileSync(file);
  let at = 12;
  while (bytes.toString('latin1', at, at + 4) !== 'data') at += 8 + bytes.readUInt32LE(at + 4);
  const count = bytes.readUInt32LE(at + 4) / 4;
  return Float32Array.from({length: count}, (_, index) => bytes.readFloatLE(at + 8 + 4 * index));
}

const most = (samples) => samples.reduce((peak, x) => Math.max(peak, Math.abs(x)), 0);

function runOfPage() {
  writeFileSync(fileIn('template.html'), '<!-- carom: runs -->');
  execFileSync(carom, ['view', fileIn('run.carom'), '--template', fileIn('template.html'), '-o',
                       fileIn('page.html'), '--no-open']);
  const page = readFileSync(fileIn('page.html'), 'latin1');
  const inside = (id) => new RegExp(`id="${id}">([^<]*)<`).exec(page)[1];
  const manifest = JSON.parse(inside('carom-page'));
  return Buffer.concat(manifest.runs[0].sound.map((blob) => gunzipSync(Buffer.from(inside(`carom-blob-${blob}`), 'base64'))));
}

class Player {
  constructor(module, bytes) {
    this.module = module;
    const copy = module.copy(bytes);
    this.run = module.exports.carom_run_open(copy, bytes.length, 48000) >>> 0;
    if (this.run === 0) throw new Error(module.lastMessage());
    module.exports.free(copy);
    this.planes = module.exports.malloc(4 * kFrames) >>> 0;
  }
  check(status) {
    if (status !== 0) throw new Error(this.module.lastMessage());
  }
  /// Renders from the run's begin on, at a place.
  render(ear, count) {
    const {exports} = this.module;
    const pose = exports.malloc(7 * 8) >>> 0;
    [...ear, 1, 0, 0, 0].forEach((value, index) =>
                                     this.module.view().setFloat64(pose + 8 * index, value, true));
    this.check(exports.carom_run_place_ear(this.run, pose));
    exports.free(pose);
    this.check(exports.carom_run_seek(this.run, 0, 1, 0));
    const samples = new Float32Array(count);
    for (let done = 0; done < count; done += kFrames) {
      const frames = Math.min(kFrames, count - done);
      this.check(exports.carom_run_render(this.run, this.planes, frames));
      samples.set(new Float32Array(exports.memory.buffer, this.planes, frames), done);
    }
    return samples;
  }
}

execFileSync(carom, ['record', scene, '-o', fileIn('run.carom')]);
const player = new Player(new CaromModule(wasm), runOfPage());
let failed = false;
for (const ear of kEars) {
  execFileSync(carom, ['replay', fileIn('run.carom'), '-o', fileIn('replay.wav'), '--full-scale', '1',
                       `--listener=${ear.join(',')}`]);
  const whole = samplesOf(fileIn('replay.wav'));
  const expected = whole.subarray(0, whole.length - kFade * 48000);
  const started = performance.now();
  const samples = player.render(ear, expected.length);
  const took = performance.now() - started;
  const peak = most(expected);
  const power = (sound) => sound.reduce((sum, sample) => sum + sample * sample, 0);
  const level = kind === 'slides'
                    ? Math.abs(10 * Math.log10(power(samples) / power(expected)))
                    : 20 * Math.log10(most(samples.map((x, index) => x - expected[index])) / peak);
  const late = player.module.exports.carom_run_late(player.run);
  const isAlike = peak > 0 && late === 0 && level < (kind === 'slides' ? kAlikeLevel : kAlike);
  failed ||= !isAlike;
  const speed = expected.length / 48000 / took * 1000;
  console.log(`${isAlike ? 'ok' : 'FAILED'} ${basename(scene)} at ${ear}: ${level.toFixed(1)} dB, ` +
              `${speed.toFixed(0)} times real time`);
}
process.exit(failed ? 1 : 0);
