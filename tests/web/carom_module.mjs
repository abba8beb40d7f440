// carom.wasm in Node: the functions that it imports, and its structs by the layout that it tells.
import {readFileSync} from 'node:fs';

const kBadDescriptor = 8;  // errno of WASI

/// The functions that the module imports. `tell` gets each line that it writes on standard error.
export function wasiImports(memoryOf, tell) {
  const view = () => new DataView(memoryOf().buffer);
  let line = '';
  const write = (bytes) => {
    line += new TextDecoder().decode(bytes);
    const lines = line.split('\n');
    line = lines.pop();
    lines.forEach(tell);
  };
  return {
    environ_sizes_get(countAt, sizeAt) {
      view().setUint32(countAt, 0, true);
      view().setUint32(sizeAt, 0, true);
      return 0;
    },
    environ_get: () => 0,
    clock_time_get(clock, precision, timeAt) {
      view().setBigUint64(timeAt, BigInt(Math.round(performance.now() * 1e6)), true);
      return 0;
    },
    fd_write(descriptor, partsAt, partCount, writtenAt) {
      let written = 0;
      for (let part = 0; part < partCount; ++part) {
        const start = view().getUint32(partsAt + 8 * part, true);
        const size = view().getUint32(partsAt + 8 * part + 4, true);
        write(new Uint8Array(memoryOf().buffer, start, size));
        written += size;
      }
      view().setUint32(writtenAt, written, true);
      return 0;
    },
    fd_close: () => kBadDescriptor,
    fd_seek: () => kBadDescriptor,
    proc_exit(code) {
      throw new Error(`carom.wasm ended itself with ${code}`);
    },
  };
}

/// An instance of the module. Addresses are numbers; views of its memory are made anew for each
/// use, as they end when it grows.
export class CaromModule {
  constructor(file) {
    this.told = [];
    const wasi = wasiImports(() => this.exports.memory, (line) => this.told.push(line));
    this.module = new WebAssembly.Module(readFileSync(file));
    this.exports = new WebAssembly.Instance(this.module, {wasi_snapshot_preview1: wasi}).exports;
    this.exports._initialize();
    // The page's module has no structs to lay out.
    if (this.exports.carom_layout) this.layout = JSON.parse(this.text(this.exports.carom_layout()));
  }

  bytes() {
    return new Uint8Array(this.exports.memory.buffer);
  }
  view() {
    return new DataView(this.exports.memory.buffer);
  }
  /// The text at an address, up to its zero.
  text(address) {
    const bytes = this.bytes();
    return new TextDecoder().decode(bytes.subarray(address, bytes.indexOf(0, address)));
  }
  /// Allocates a copy of bytes; freed with `exports.free`.
  copy(bytes) {
    const address = this.exports.malloc(Math.max(bytes.length, 1)) >>> 0;
    this.bytes().set(bytes, address);
    return address;
  }
  copyText(text) {
    return this.copy(new TextEncoder().encode(text + '\0'));
  }
  lastMessage() {
    return this.text(this.exports.carom_last_message() >>> 0);
  }

  /// Allocates structs with their defaults, or zeros where they have none.
  makeStructs(type, count = 1) {
    const size = this.layout.structs[type].size;
    const first = this.copy(new Uint8Array(count * size));
    for (let index = 0; index < count; ++index) this.initStruct(type, first + index * size, size);
    return first;
  }
  initStruct(type, address, size) {
    this.setField(type, address, 'size', [size]);
    const init = this.exports[`${type}_init`];
    if (init !== undefined && init(address, size) !== 0) throw new Error(this.lastMessage());
  }
  setField(type, address, field, values) {
    const [offset, kind] = this.layout.structs[type].fields[field];
    values.forEach((value, index) => setNumber(this.view(), address + offset, kind, index, value));
  }
  field(type, address, field) {
    const [offset, kind] = this.layout.structs[type].fields[field];
    const view = this.view();
    if (kind === 'f64') return view.getFloat64(address + offset, true);
    if (kind === 'u64') return Number(view.getBigUint64(address + offset, true));
    return kind === 'i32' ? view.getInt32(address + offset, true)
                          : view.getUint32(address + offset, true);
  }
}

/// Writes a number of an array of one kind.
export function setNumber(view, address, kind, index, value) {
  if (kind === 'f64') view.setFloat64(address + 8 * index, value, true);
  else if (kind === 'f32') view.setFloat32(address + 4 * index, value, true);
  else if (kind === 'i32') view.setInt32(address + 4 * index, value, true);
  else if (kind === 'u32') view.setUint32(address + 4 * index, value, true);
  else view.setBigUint64(address + 8 * index, BigInt(value), true);
}
