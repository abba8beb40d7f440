// How long carom.wasm takes to render in Node, beside this machine's library in the same run.
// Usage: node module_bench.mjs MODULE PLAYER FOLDER
import {execFileSync} from 'node:child_process';
import {mkdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {playInModule} from './call_list.mjs';
import {CaromModule} from './carom_module.mjs';
import {longRing, manyClicks} from './scenes.mjs';

const kRuns = 5;

const [modulePath, player, folder] = process.argv.slice(2);
mkdirSync(folder, {recursive: true});
const files = {model: join(folder, 'block.carom_modes')};
execFileSync(player, ['model', files.model]);

function nativeTime(calls) {
  return JSON.parse(execFileSync(player, ['play', calls, join(folder, 'bench.f32')])).rendering;
}

for (const [name, scene] of Object.entries({'20,000 clicks in 10 s': manyClicks,
                                            '64 modes that ring, 10 s': longRing})) {
  const carom = new CaromModule(modulePath);
  const list = scene(carom.layout, files);
  const calls = join(folder, 'bench.txt');
  writeFileSync(calls, list.text());
  const times = {module: [], library: []};
  for (let run = 0; run < kRuns; ++run) {
    times.module.push(playInModule(carom, list).rendering);
    times.library.push(nativeTime(calls));
  }
  const [inModule, natively] = [times.module, times.library].map((all) => Math.min(...all));
  console.log(`${name}: module ${(1e3 * inModule).toFixed(1)} ms, library ` +
              `${(1e3 * natively).toFixed(1)} ms, ratio ${(inModule / natively).toFixed(2)} ` +
              `(least of ${kRuns})`);
}
