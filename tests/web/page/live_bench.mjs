// node live_bench.mjs CAROM_PAGE.WASM SCENE.json [SECONDS] [CAROM]
// CPU seconds of a scene's mechanics and sound, live as in the page but without a picture: on the native stepper and on Bullet.
// With CAROM, the program, also how far the sound's level is from that of `carom replay` of the run, which is exact: in whole, and in
// third octaves that are at most 40 dB below the loudest.
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {Engine} from '../../../web/page/sound/engine.js';
import {beginRun} from '../../../web/page/live/growth.js';
import {Mechanics} from '../../../web/page/live/mechanics.js';

const kQuantum = 128, kAhead = 0.12;   // frames that a worklet renders at once; s that the mechanics is ahead
const kEar = [0, 0.45, 0.2];           // m
const kThird = 2 ** (1 / 3), kQuiet = 1e-4;

const cpu = () => {
  const {user, system} = process.cpuUsage();
  return (user + system) / 1e6;
};

const [wasm, file, seconds = '10', carom] = process.argv.slice(2);
if (file === undefined) throw new Error('usage: node live_bench.mjs CAROM_PAGE.WASM SCENE.json [SECONDS] [CAROM]');
const module = new WebAssembly.Module(readFileSync(wasm));
const text = readFileSync(file, 'utf8'), rate = JSON.parse(text).sample_rate ?? 48000;

for (const stepper of ['native', 'bullet']) {
  try {
    await measure(stepper);
  } catch (error) {
    console.log(`${stepper}: ${error.message}`);
  }
}

async function measure(stepper) {
  const begin = cpu();
  const mechanics = new Mechanics(module, {text}, null);
  if ((JSON.parse(text).stepper?.type ?? 'native') !== stepper) mechanics.setStepper(stepper === 'bullet', 1 / 240);
  const engine = new Engine(module);
  engine.open(mechanics.part('opening'), rate, null);
  engine.setOpen();
  const run = await beginRun(mechanics, 0), {growth} = run;
  engine.hear({format: carom ? 'mono' : 'pair', pose: [...kEar, 1, 0, 0, 0]});
  engine.seek(0, 1, 0);
  const opened = cpu() - begin;
  const heard = [];
  let peak = 0, appended = 0;
  // To ask for CPU time takes longer than to render a quantum: the clock shares it out.
  const from = cpu(), parts = {mechanics: 0, sound: 0};
  while (engine.time < Number(seconds)) {
    const before = performance.now();
    while (run.duration < engine.time + kAhead) growth.advance();
    while (appended < growth.pieces.length) engine.append(growth.pieces[appended++].sound);
    const middle = performance.now();
    const [plane] = engine.render(kQuantum);
    if (carom) heard.push(...plane);
    for (const sample of plane) peak = Math.max(peak, Math.abs(sample));
    parts.mechanics += middle - before;
    parts.sound += performance.now() - middle;
  }
  const spent = cpu() - from, share = spent / (parts.mechanics + parts.sound);
  console.log(`${stepper}: ${seconds} s cost ${spent.toFixed(2)} CPU s: ${(share * parts.mechanics).toFixed(2)} mechanics, `
              + `${(share * parts.sound).toFixed(2)} sound, ${opened.toFixed(2)} to begin; ${growth.pieces.at(-1).told} events, `
              + `peak ${peak.toPrecision(3)} Pa, ${engine.late} late`);
  if (carom) console.log(`  ${levels(heard, exact(mechanics.part('file'), heard.length), rate)}`);
}

/// What `carom replay` renders of a run.
function exact(run, count) {
  const folder = mkdtempSync(join(tmpdir(), 'carom-live-'));
  try {
    writeFileSync(join(folder, 'run.carom'), run);
    execFileSync(carom, ['replay', join(folder, 'run.carom'), '-o', join(folder, 'exact.wav'), '--full-scale', '1', `--listener=${kEar.join(',')}`],
                 {stdio: 'ignore'});
    const bytes = readFileSync(join(folder, 'exact.wav'));
    let at = 12;
    while (bytes.toString('latin1', at, at + 4) !== 'data') at += 8 + bytes.readUInt32LE(at + 4);
    return Float64Array.from({length: Math.min(count, bytes.readUInt32LE(at + 4) / 4)}, (_, index) => bytes.readFloatLE(at + 8 + 4 * index));
  } finally {
    rmSync(folder, {recursive: true});
  }
}

/// The power of what a band lets through.
function power(samples, frequency, rate) {
  const turn = 2 * Math.PI * frequency / rate, alpha = Math.sin(turn) * Math.sinh(Math.log(kThird) / 2 * turn / Math.sin(turn));
  const [b, a0, a1, a2] = [alpha, 1 + alpha, -2 * Math.cos(turn), 1 - alpha];
  let x1 = 0, x2 = 0, y1 = 0, y2 = 0, sum = 0;
  for (const x of samples) {
    const y = (b * (x - x2) - a1 * y1 - a2 * y2) / a0;
    [x2, x1, y2, y1] = [x1, x, y1, y];
    sum += y * y;
  }
  return sum;
}

function levels(ours, theirs, rate) {
  const same = ours.slice(0, theirs.length);
  const whole = (samples) => samples.reduce((sum, x) => sum + x * x, 0);
  const between = (one, other) => 10 * Math.log10(one / other);
  const bands = [];
  for (let frequency = 50; frequency < 18000; frequency *= kThird) bands.push([frequency, power(same, frequency, rate), power(theirs, frequency, rate)]);
  const loudest = Math.max(...bands.map((band) => band[2]));
  const worst = bands.filter((band) => band[2] > kQuiet * loudest).map(([frequency, one, other]) => [frequency, between(one, other)])
                    .reduce((far, band) => Math.abs(band[1]) > Math.abs(far[1]) ? band : far);
  return `beside the exact sound: ${between(whole(same), whole(theirs)).toFixed(2)} dB in level, ${worst[1].toFixed(2)} dB in the third octave that is `
         + `farthest off, at ${worst[0].toFixed(0)} Hz`;
}
