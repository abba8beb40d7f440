// node live_bench.mjs CAROM_PAGE.WASM SCENE.json [SECONDS]
// CPU seconds of a scene's mechanics and sound, live as in the page but without a picture: on the native stepper and on Bullet.
import {readFileSync} from 'node:fs';
import {Engine} from '../../../web/page/sound/engine.js';
import {Mechanics} from '../../../web/page/live/mechanics.js';

const kQuantum = 128, kAhead = 0.12;   // frames that a worklet renders at once; s that the mechanics is ahead

const cpu = () => {
  const {user, system} = process.cpuUsage();
  return (user + system) / 1e6;
};

const [wasm, file, seconds = '10'] = process.argv.slice(2);
if (file === undefined) throw new Error('usage: node live_bench.mjs CAROM_PAGE.WASM SCENE.json [SECONDS]');
const module = new WebAssembly.Module(readFileSync(wasm));
const text = readFileSync(file, 'utf8'), rate = JSON.parse(text).sample_rate ?? 48000;

for (const stepper of ['native', 'bullet']) {
  try {
    measure(stepper);
  } catch (error) {
    console.log(`${stepper}: ${error.message}`);
  }
}

function measure(stepper) {
  const begin = cpu();
  const mechanics = new Mechanics(module, text, null);
  if ((JSON.parse(text).stepper?.type ?? 'native') !== stepper) mechanics.setStepper(stepper === 'bullet', 1 / 240);
  mechanics.take();
  const engine = new Engine(module);
  engine.open(mechanics.part('opening'), rate, null);
  engine.setOpen();
  engine.append(mechanics.part('sound'));
  engine.hear({format: 'pair', pose: [0, 0.45, 0.2, 1, 0, 0, 0]});
  engine.seek(0, 1, 0);
  const spent = {open: cpu() - begin, mechanics: 0, sound: 0};
  let events = 0, peak = 0;
  while (engine.time < Number(seconds)) {
    const before = cpu();
    while (mechanics.settled < engine.time + kAhead) {
      mechanics.advance();
      mechanics.take();
      events += mechanics.part('events').length / 112;
      for (const part of ['poses', 'contacts', 'bodies']) mechanics.part(part);
      engine.append(mechanics.part('sound'));
    }
    const middle = cpu();
    const [plane] = engine.render(kQuantum);
    for (const sample of plane) peak = Math.max(peak, Math.abs(sample));
    spent.mechanics += middle - before;
    spent.sound += cpu() - middle;
  }
  console.log(`${stepper}: ${seconds} s cost ${(spent.mechanics + spent.sound).toFixed(2)} CPU s: ${spent.mechanics.toFixed(2)} mechanics, `
              + `${spent.sound.toFixed(2)} sound, ${spent.open.toFixed(2)} to begin; ${events} events, peak ${peak.toPrecision(3)} Pa, ${engine.late} late`);
}
