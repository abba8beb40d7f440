// What the module needs beside the C API, whose functions come from carom::plugin by the linker's
// options.

/// Registers what ends with its thread. The module's only thread does not end before its memory.
extern "C" int __cxa_thread_atexit(void (*)(void*), void*, void*) {
  return 0;
}
