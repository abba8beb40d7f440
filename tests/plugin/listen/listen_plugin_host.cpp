// listen_plugin_host PLUGIN: opens the plugin for itself alone, runs it, and closes it.

#include <cstdio>

#include <dlfcn.h>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  void* const plugin = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
  if (plugin == nullptr) {
    std::fprintf(stderr, "%s\n", dlerror());
    return 1;
  }
  using Run = void (*)();
  const auto run = reinterpret_cast<Run>(dlsym(plugin, "runListenPlugin"));
  if (run == nullptr) return 1;
  run();
  return dlclose(plugin) == 0 ? 0 : 1;
}
