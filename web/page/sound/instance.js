// An instance of the engine's module: what it imports, its messages, and bytes that go in and out.
// Worklets have neither TextDecoder nor performance, so this file uses neither.

const kBadDescriptor = 8;  // errno of WASI

function wasi(memory) {
  const view = () => new DataView(memory().buffer);
  const start = Date.now();
  return {
    clock_time_get(clock, precision, at) {
      view().setBigUint64(at, BigInt(Date.now() - start) * 1000000n, true);
      return 0;
    },
    environ_sizes_get(count, size) {
      view().setUint32(count, 0, true);
      view().setUint32(size, 0, true);
      return 0;
    },
    environ_get: () => 0,
    // Messages are read from carom_last_message.
    fd_write: () => kBadDescriptor,
    fd_close: () => kBadDescriptor,
    fd_seek: () => kBadDescriptor,
    proc_exit() {
      throw new Error('the engine has ended');
    },
  };
}

/// True if the module has a function; older ones have fewer.
export function exportsOf(module, name) {
  return WebAssembly.Module.exports(module).some((item) => item.name === name);
}

export class Instance {
  constructor(module) {
    this.carom = new WebAssembly.Instance(module, {wasi_snapshot_preview1: wasi(() => this.carom.memory)}).exports;
    this.carom._initialize();
  }

  /// The engine's own sentence about what it has refused last.
  message() {
    const at = this.carom.carom_last_message() >>> 0;
    const bytes = new Uint8Array(this.carom.memory.buffer);
    let text = '';
    for (let byte = at; at && bytes[byte]; ++byte) text += String.fromCharCode(bytes[byte]);
    return text || 'the engine refuses, and does not say why';
  }
  check(status) {
    if (status !== 0) throw new Error(this.message());
  }
  /// Puts bytes into the instance's memory; the caller frees them.
  copy(bytes) {
    const at = this.carom.malloc(Math.max(1, bytes.length)) >>> 0;
    if (!at) throw new Error('there is no memory left');
    new Uint8Array(this.carom.memory.buffer).set(bytes, at);
    return at;
  }
  /// Calls `act(address, size)` with bytes that are in the instance's memory meanwhile.
  with(bytes, act) {
    const at = this.copy(bytes);
    const result = act(at, bytes.length);
    this.carom.free(at);
    return result;
  }
}
