// node build.mjs CAROM.WASM OUT.html: one page with three.js, this folder's code and style, and the engine inside.
// `carom view` puts runs in place of its line of runs (docs/view.md). With `-` for the module the page is silent.
import {build, transform} from 'esbuild';
import {readFileSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {gzipSync} from 'node:zlib';

const kFolder = dirname(fileURLToPath(import.meta.url));
const kRuns = '<!-- carom: runs -->';

async function bundle(entry, plugins = []) {
  const {outputFiles} = await build({
    entryPoints: [join(kFolder, entry)], bundle: true, minify: true, write: false, format: 'iife',
    target: ['chrome107', 'firefox113', 'safari16.4'], legalComments: 'none', charset: 'utf8', loader: {'.txt': 'text'}, plugins,
  });
  return outputFiles[0].text;
}

/// The worklet is a script of its own, which the page's script holds as a text.
function workletAsText(text) {
  return {
    name: 'worklet',
    setup(plugin) {
      plugin.onResolve({filter: /^carom:worklet$/}, () => ({path: 'worklet', namespace: 'carom'}));
      plugin.onLoad({filter: /.*/, namespace: 'carom'},
                    () => ({contents: `export default ${JSON.stringify(text)}`, loader: 'js'}));
    },
  };
}

/// Inside a script element these would end it, or begin a comment.
function inScript(text) {
  return text.replace(/<(?=\/script|!--|script)/gi, '\\x3C');
}

function put(page, place, text) {
  const parts = page.split(`<!-- carom: ${place} -->`);
  if (parts.length !== 2) throw new Error(`page.html has ${parts.length - 1} places for ${place}`);
  return parts.join(text);
}

const [wasm, out] = process.argv.slice(2);
if (out === undefined) throw new Error('usage: node build.mjs CAROM.WASM|- OUT.html');
const worklet = await bundle('sound/worklet.js');
const script = await bundle('main.js', [workletAsText(worklet)]);
const start = inScript((await transform(readFileSync(join(kFolder, 'start.js'), 'utf8'), {minify: true})).code);
const style = (await transform(readFileSync(join(kFolder, 'page.css'), 'utf8'), {loader: 'css', minify: true})).code;
const packed = (bytes) => gzipSync(bytes, {level: 9}).toString('base64');
const engine = wasm === '-' ? '' : packed(readFileSync(wasm)), code = packed(script);
let page = readFileSync(join(kFolder, 'page.html'), 'utf8');
page = put(page, 'style', `<style>${style}</style>`);
page = put(page, 'engine', `<script type="application/octet-stream" id="carom-engine">${engine}</script>`);
page = put(page, 'script', `<script type="application/octet-stream" id="carom-script">${code}</script>\n<script>${start}</script>`);
if (page.split(kRuns).length !== 2) throw new Error('the page must have one place for runs');
writeFileSync(out, page);
console.log(`${out}: ${page.length} bytes, of which ${code.length} script, ${engine.length} engine`);
