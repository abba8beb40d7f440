// The functions that the physics server looks up, by the names of p.loadPlugin(path, "_carom"): see
// bulletphysics/bullet3, examples/SharedMemory/b3PluginManager.cpp; and two by which a program in
// the same process takes samples and events, such as carom.py.

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

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
///
/// A server must not load any plugin once one was unloaded: the slot of the old one is reused as if
/// it had no library, which ends the program. So a program that is through with its sound closes it
/// and leaves the plugin loaded, and one that begins opens another.
struct Plugin {
  carom::audio::Mutex mutex{};
  carom::b3::ServerFunctions server{};
  carom::b3::Client client = nullptr;
  int name = 0;                                         // of the sound, among all that were
  std::unique_ptr<carom::plugin::ServerSound> sound{};  // null once it is closed
  // The answer to the latest command; the server reads it after the command, and again for the rest
  // of a long one.
  std::string text{};
  carom::b3::UserDataValue value{};
};

/// Frees the tables of the library when the server unloads it.
struct Unloading {
  ~Unloading() { carom::audio::deleteImmortals(); }
} const unloading;

/// The plugins that are loaded.
struct Instances {
  carom::audio::Mutex mutex;
  std::vector<std::shared_ptr<Plugin>> plugins;
  int latest = 0;

  static Instances& all() {
    static Instances& instances = carom::audio::immortal([] { return Instances(); });
    return instances;
  }
  std::shared_ptr<Plugin> find(int name) {
    const carom::audio::MutexLock lock(mutex);
    const auto found = std::ranges::find(plugins, name, &Plugin::name);
    return found == plugins.end() || name == 0 ? nullptr : *found;
  }
  /// Gives a plugin's sound another name, that nobody has had; 0 for none.
  void rename(Plugin& plugin, bool hasSound) {
    const carom::audio::MutexLock lock(mutex);
    plugin.name = hasSound ? ++latest : 0;
  }
  void add(const std::shared_ptr<Plugin>& plugin) {
    const carom::audio::MutexLock lock(mutex);
    plugins.push_back(plugin);
  }
  std::shared_ptr<Plugin> remove(const Plugin& plugin) {
    const carom::audio::MutexLock lock(mutex);
    const auto found = std::ranges::find(plugins, &plugin, &std::shared_ptr<Plugin>::get);
    if (found == plugins.end()) return nullptr;
    std::shared_ptr<Plugin> removed = std::move(*found);
    plugins.erase(found);
    return removed;
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

/// Makes a plugin's sound anew, in place of one that there may be.
carom::Status open(Plugin& plugin) {
  plugin.sound.reset();
  auto sound = carom::plugin::ServerSound::create(plugin.server, plugin.client);
  if (!sound) return sound.error();
  plugin.sound = *std::move(sound);
  Instances::all().rename(plugin, true);
  plugin.sound->setName(plugin.name);
  return std::monostate{};
}

void close(Plugin& plugin) {
  plugin.sound.reset();
  Instances::all().rename(plugin, false);
}

/// Takes "as NAME" from the front of a command: the sound that it is for.
std::optional<int> takeName(std::string_view& text) {
  constexpr std::string_view kAs = "as ";
  if (!text.starts_with(kAs)) return std::nullopt;
  int name = 0;
  const auto [end, fault] =
      std::from_chars(text.data() + kAs.size(), text.data() + text.size(), name);
  if (fault != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return name;
}

/// Runs a command: `open` and `close` here, all others in the sound.
carom::Result<std::string> run(Plugin& plugin, std::string_view text) {
  if (text == "open") {
    if (const carom::Status opened = open(plugin); !opened) return opened.error();
    return plugin.sound->execute("describe");
  }
  const std::optional<int> name = takeName(text);
  if (plugin.sound == nullptr) return carom::Error{"the sound is closed; open another"};
  if (name && *name != plugin.name)
    return carom::Error{"this sound was closed, or another one was opened in its place"};
  if (name && text.starts_with(' ')) text.remove_prefix(1);
  if (text != "close") return plugin.sound->execute(text);
  carom::Result<std::string> stopped = plugin.sound->execute("stop");
  close(plugin);
  return stopped;
}

int start(PluginContext& context, const void* caller) {
  carom::Result<carom::b3::ServerFunctions> server = carom::b3::findServerFunctions(caller);
  if (!server) {
    complain(server.error().message.c_str());
    return -1;
  }
  const auto plugin = std::make_shared<Plugin>();
  plugin->server = *std::move(server);
  plugin->client = context.client;
  Instances::all().add(plugin);
  if (const carom::Status opened = open(*plugin); !opened) {
    complain(opened.error().message.c_str());
    (void)Instances::all().remove(*plugin);
    return -1;
  }
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
    if (plugin->sound == nullptr || plugin->name != instance) return -1;
    numbers = static_cast<long long>(take(*plugin->sound, place, to == nullptr));
    return 0;
  });
  return numbers;
}

int execute(Plugin& plugin, PluginContext& context, const PluginArguments& arguments) {
  const auto end = std::ranges::find(arguments.text, '\0');
  const std::string_view text(arguments.text.data(),
                              static_cast<std::size_t>(end - arguments.text.begin()));
  const carom::Result<std::string> done = run(plugin, text);
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
  Plugin* const plugin = pluginOf(context);
  if (plugin == nullptr) return;
  context->userPointer = nullptr;
  (void)guarded([plugin] {
    (void)Instances::all().remove(*plugin);  // somebody may still be taking samples
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
    if (plugin.sound) plugin.sound->world().beginSubstep();
    return 0;
  });
}

CAROM_EXPORT int postTickPluginCallback_carom(PluginContext* context) {
  return working(context, [](Plugin& plugin) {
    if (plugin.sound) plugin.sound->world().endSubstep();
    return 0;
  });
}

CAROM_EXPORT int processNotifications_carom(PluginContext* context) {
  if (context == nullptr || context->notifications == nullptr) return -1;
  return working(context, [context](Plugin& plugin) {
    if (plugin.sound)
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
