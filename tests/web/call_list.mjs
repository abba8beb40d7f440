// A list of calls of the C API, to be made in the module, and by web_call_player on this machine:
// call_player.cpp describes the steps.
import {readFileSync} from 'node:fs';

import {setNumber} from './carom_module.mjs';

export class CallList {
  constructor(layout) {
    this.layout = layout;
    this.steps = [];
  }

  add(...step) {
    this.steps.push(step.map((word) => this.layout.constants[word] ?? word));
  }
  struct(type, name, fields = {}) {
    this.add('struct', type, name);
    this.set(name, fields);
  }
  set(name, fields) {
    for (const [field, value] of Object.entries(fields)) this.add('set', name, field, ...[value].flat());
  }
  numbers(name, kind, values) {
    this.steps.push(['numbers', name, kind].concat(values));
  }
  call(name, ...values) {
    this.add('call', name, ...values);
  }

  text() {
    return this.steps.map((step) => step.join(' ') + '\n').join('');
  }
}

/// Makes the calls in a module. Returns the samples, and how long rendering took.
export function playInModule(carom, list) {
  const player = new ModulePlayer(carom);
  list.steps.forEach((step) => player.step(step));
  return {samples: player.samples(), rendering: player.rendering};
}

class ModulePlayer {
  constructor(carom) {
    this.carom = carom;
    this.addresses = new Map();  // of structs and arrays, and of where handles are kept
    this.types = new Map();
    this.handles = new Set();
    this.blocks = [];
    this.rendering = 0;  // s
  }

  step([step, name, ...values]) {
    if (step === 'struct') this.makeStructs(name, ...values);
    else if (step === 'set') this.set(name, values);
    else if (step === 'numbers') this.makeNumbers(name, values);
    else if (step === 'file') this.addresses.set(name, this.carom.copy(readFileSync(values[0])));
    else if (step === 'call') this.call(name, values);
    else if (step === 'render') this.render(name, values[0]);
    else throw new Error(`there is no step ${step}`);
  }

  makeStructs(type, name, count = 1) {
    this.types.set(name, type);
    this.replace(name, this.carom.makeStructs(type, count));
  }
  set(element, [field, ...values]) {
    const [name, index = 0] = element.split(':');
    const type = this.types.get(name);
    const address = this.addresses.get(name) + index * this.carom.layout.structs[type].size;
    this.carom.setField(type, address, field, values.map((value) => this.valueOf(value)));
  }
  makeNumbers(name, [kind, ...values]) {
    const bytes = new Uint8Array(8 * values.length);
    const view = new DataView(bytes.buffer);
    values.forEach((value, index) => setNumber(view, 0, kind, index, value));
    this.replace(name, this.carom.copy(bytes));
  }
  replace(name, address) {
    if (this.addresses.has(name)) this.carom.exports.free(this.addresses.get(name));
    this.addresses.set(name, address);
  }

  valueOf(value) {
    if (typeof value !== 'string') return value;
    const name = value.slice(1);
    if (value[0] === '"') return this.carom.copyText(name);
    if (value[0] === '>') {
      this.handles.add(name);
      this.addresses.set(name, this.carom.copy(new Uint8Array(4)));
      return this.addresses.get(name);
    }
    const [base, offset = 0] = name.split('+');
    const address = this.addresses.get(base) + Number(offset);
    return this.handles.has(name) ? this.carom.view().getUint32(address, true) : address;
  }

  call(name, values) {
    const status = this.carom.exports[name](...values.map((value) => this.valueOf(value)));
    if (status !== 0) throw new Error(`${name}: ${this.carom.lastMessage()}`);
  }

  render(sound, frames) {
    const handle = this.valueOf(sound);
    const channels = this.carom.exports.carom_channel_count(handle);
    const size = 4 * channels * frames;
    const address = this.carom.exports.malloc(size) >>> 0;
    const begin = performance.now();
    const status = this.carom.exports.carom_render_interleaved(handle, address, channels, frames);
    this.rendering += (performance.now() - begin) / 1e3;
    if (status !== 0) throw new Error(`carom_render_interleaved: ${status}`);
    const block = this.carom.bytes().slice(address, address + size);
    this.blocks.push(new Float32Array(block.buffer));
    this.carom.exports.free(address);
  }

  samples() {
    const all = new Float32Array(this.blocks.reduce((sum, block) => sum + block.length, 0));
    let at = 0;
    for (const block of this.blocks) {
      all.set(block, at);
      at += block.length;
    }
    return all;
  }
}
