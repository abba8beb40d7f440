// The functions that the physics server looks up, by the names of p.loadPlugin(path, "_carom"): see
// bulletphysics/bullet3, examples/SharedMemory/b3PluginManager.cpp; and two by which a program in
// the same process takes samples and events, such as carom.py.

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "audio/model/immortal.h"
#include "audio/model/mutex.h"
#include "plugin/pybullet/server_abi.h"
#include "plugin/pybullet/server_api.h"
#include "plugin/pybullet/server_sound.h"

#define CAROM_EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using carom::b3::PluginArguments;
using carom::b3::PluginContext;

/// The object behind the server's pointer, from initPlugin to exitPlugin. Those who take samples
/// may be in another thread than the physics.
struct Plugin {
  carom::audio::Mutex mutex{};
  int name = 0;  // among those there are
  std::unique_ptr<carom::plugin::ServerSound> sound{};
  // The answer to the latest command; the server reads it after the command, and again for the rest
  // of a long one.
  std::string text{};
  carom::b3::UserDataValue value{};
};

/// Frees the tables of the library when the server unloads it.
struct Unloading {
  ~Unloading() { carom::audio::deleteImmortals(); }
} const unloading;

/// The plugins there are, by their names.
struct Instances {
  carom::audio::Mutex mutex;
  std::map<int, std::shared_ptr<Plugin>> plugins;
  int latest = 0;

  static Instances& all() {
    static Instances& instances = carom::audio::immortal([] { return Instances(); });
    return instances;
  }
  std::shared_ptr<Plugin> find(int name) {
    const carom::audio::MutexLock lock(mutex);
    const auto found = plugins.find(name);
    return found == plugins.end() ? nullptr : found->second;
  }
};

Plugin* pluginOf(const PluginContext* context) {
  return context != nullptr ? static_cast<Plugin*>(context->userPointer) : nullptr;
}

void complain(const char* why) {
  (void)std::fprintf(stderr, "carom: %s\n", why);
}

// Replaces what is not ASCII: Python gets the bytes as numbers with a sign, so only those of ASCII
// come out right.
std::string plain(std::string text) {
  std::ranges::replace_if(
      text, [](char each) { return static_cast<unsigned char>(each) >= 0x80U; }, '?');
  return text;
}

void giveBack(Plugin& plugin, PluginContext& context, std::string text) {
  plugin.text = plain(std::move(text));
  plugin.value = {carom::b3::kTextValue, static_cast<int>(plugin.text.size()), plugin.text.c_str()};
  context.returnData = &plugin.value;
}

// Runs `work` such that the server sees no exceptions; only a lack of memory throws.
template <class Work>
int guarded(Work work) noexcept {
  try {
    return work();
  } catch (const std::exception& fault) {
    complain(fault.what());
  } catch (...) {
    complain("unknown failure");
  }
  return -1;
}

int start(PluginContext& context, const void* caller) {
  carom::Result<carom::b3::ServerFunctions> server = carom::b3::findServerFunctions(caller);
  if (!server) {
    complain(server.error().message.c_str());
    return -1;
  }
  Instances& instances = Instances::all();
  const carom::audio::MutexLock lock(instances.mutex);
  const int name = instances.latest + 1;
  auto sound = carom::plugin::ServerSound::create(*std::move(server), context.client, name);
  if (!sound) {
    complain(sound.error().message.c_str());
    return -1;
  }
  const auto plugin = std::make_shared<Plugin>();
  plugin->name = instances.latest = name;
  plugin->sound = *std::move(sound);
  instances.plugins[name] = plugin;
  context.userPointer = plugin.get();
  return carom::b3::kMagicNumber;
}

/// Runs `work` on the sound of a plugin, as `guarded` does, while nobody else is at it.
template <class Work>
int working(const PluginContext* context, Work work) noexcept {
  Plugin* const plugin = pluginOf(context);
  if (plugin == nullptr) return -1;
  return guarded([&] {
    const carom::audio::MutexLock lock(plugin->mutex);
    return work(*plugin);
  });
}

/// Takes what waits of a plugin by `take`, or without a place for it says how much does.
template <class Number, class Take>
long long taken(int instance, Number* to, long long count, const Take& take) noexcept {
  long long numbers = -1;
  (void)guarded([&] {
    const std::shared_ptr<Plugin> plugin = Instances::all().find(instance);
    if (!plugin || count < 0) return -1;
    const carom::audio::MutexLock lock(plugin->mutex);
    const std::span<Number> place(to, to == nullptr ? 0 : static_cast<std::size_t>(count));
    numbers = static_cast<long long>(take(*plugin->sound, place, to == nullptr));
    return 0;
  });
  return numbers;
}

int execute(Plugin& plugin, PluginContext& context, const PluginArguments& arguments) {
  const auto end = std::ranges::find(arguments.text, '\0');
  const std::string_view text(arguments.text.data(),
                              static_cast<std::size_t>(end - arguments.text.begin()));
  const carom::Result<std::string> done = plugin.sound->execute(text);
  giveBack(plugin, context, done ? *done : done.error().message);
  if (done) return 0;
  complain(plugin.text.c_str());  // the result of executePluginCommand is rarely looked at
  return -1;
}

}  // namespace

/// Returns the magic number, or -1, which the server reports as a plugin of a wrong version; the
/// reason is on the standard error output.
CAROM_EXPORT int initPlugin_carom(PluginContext* context) {
  if (context == nullptr) return -1;
  context->userPointer = nullptr;
  const void* const caller = __builtin_return_address(0);
  return guarded([&] { return start(*context, caller); });
}

CAROM_EXPORT void exitPlugin_carom(PluginContext* context) {
  const Plugin* const plugin = pluginOf(context);
  if (plugin == nullptr) return;
  context->userPointer = nullptr;
  (void)guarded([&] {
    Instances& instances = Instances::all();
    std::shared_ptr<Plugin> last;
    const carom::audio::MutexLock lock(instances.mutex);
    if (const auto found = instances.plugins.find(plugin->name); found != instances.plugins.end()) {
      last = std::move(found->second);
      instances.plugins.erase(found);
    }
    return 0;
  });
}

/// Returns 0 if the command was done, -1 if it was refused; a sentence or more as return data.
CAROM_EXPORT int executePluginCommand_carom(PluginContext* context,
                                            const PluginArguments* arguments) {
  if (arguments == nullptr) return -1;
  return working(context, [&](Plugin& plugin) { return execute(plugin, *context, *arguments); });
}

CAROM_EXPORT int preTickPluginCallback_carom(PluginContext* context) {
  return working(context, [](Plugin& plugin) {
    plugin.sound->world().beginSubstep();
    return 0;
  });
}

CAROM_EXPORT int postTickPluginCallback_carom(PluginContext* context) {
  return working(context, [](Plugin& plugin) {
    plugin.sound->world().endSubstep();
    return 0;
  });
}

CAROM_EXPORT int processNotifications_carom(PluginContext* context) {
  if (context == nullptr || context->notifications == nullptr) return -1;
  return working(context, [context](Plugin& plugin) {
    plugin.sound->world().hear(
        {context->notifications, static_cast<std::size_t>(context->notificationCount)});
    return 0;
  });
}

/// Moves the oldest captured samples, in Pa, to `samples`, which has room for `count`: whole frames
/// of all channels. Returns how many, or if `samples` is null how many wait; -1 if there is no such
/// instance (the command `describe` says which it is). [any thread]
CAROM_EXPORT long long takeSamples_carom(int instance, float* samples, long long count) {
  return taken(instance, samples, count,
               [](carom::plugin::ServerSound& sound, std::span<float> place, bool onlyCounts) {
                 const std::size_t frames =
                     onlyCounts ? sound.framesReady() : sound.takeFrames(place);
                 return frames * sound.channels();
               });
}

/// Moves the oldest rows of events to `numbers`: see takeSamples_carom, and EventTable for the
/// columns. [any thread]
CAROM_EXPORT long long takeEvents_carom(int instance, double* numbers, long long count) {
  return taken(instance, numbers, count,
               [](carom::plugin::ServerSound& sound, std::span<double> place, bool onlyCounts) {
                 const std::size_t rows =
                     onlyCounts ? sound.eventsReady() : sound.takeEvents(place);
                 return rows * sound.eventColumns();
               });
}
