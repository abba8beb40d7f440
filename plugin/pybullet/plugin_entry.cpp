// The functions that the physics server looks up, by the names of p.loadPlugin(path, "_carom"): see
// bulletphysics/bullet3, examples/SharedMemory/b3PluginManager.cpp.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "audio/model/immortal.h"
#include "plugin/pybullet/server_abi.h"
#include "plugin/pybullet/server_api.h"
#include "plugin/pybullet/server_sound.h"

#define CAROM_EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using carom::b3::PluginArguments;
using carom::b3::PluginContext;

/// The object behind the server's pointer, from initPlugin to exitPlugin.
struct Plugin {
  std::unique_ptr<carom::plugin::ServerSound> sound;
  // The answer to the latest command; the server reads it after the command, and again for the rest
  // of a long one.
  std::string text{};
  carom::b3::UserDataValue value{};
};

/// Frees the tables of the library when the server unloads it.
struct Unloading {
  ~Unloading() { carom::audio::deleteImmortals(); }
} const unloading;

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
  auto sound = carom::plugin::ServerSound::create(*std::move(server), context.client);
  if (!sound) {
    complain(sound.error().message.c_str());
    return -1;
  }
  context.userPointer = std::make_unique<Plugin>(Plugin{*std::move(sound)}).release();
  return carom::b3::kMagicNumber;
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
  if (context == nullptr) return;
  const std::unique_ptr<Plugin> plugin(pluginOf(context));
  context->userPointer = nullptr;
}

/// Returns 0 if the command was done, -1 if it was refused; a sentence or more as return data.
CAROM_EXPORT int executePluginCommand_carom(PluginContext* context,
                                            const PluginArguments* arguments) {
  Plugin* const plugin = pluginOf(context);
  if (plugin == nullptr || arguments == nullptr) return -1;
  return guarded([&] { return execute(*plugin, *context, *arguments); });
}

CAROM_EXPORT int preTickPluginCallback_carom(PluginContext* context) {
  Plugin* const plugin = pluginOf(context);
  if (plugin == nullptr) return -1;
  return guarded([&] {
    plugin->sound->beginSubstep();
    return 0;
  });
}

CAROM_EXPORT int postTickPluginCallback_carom(PluginContext* context) {
  Plugin* const plugin = pluginOf(context);
  if (plugin == nullptr) return -1;
  return guarded([&] {
    plugin->sound->endSubstep();
    return 0;
  });
}

CAROM_EXPORT int processNotifications_carom(PluginContext* context) {
  Plugin* const plugin = pluginOf(context);
  if (plugin == nullptr || context->notifications == nullptr) return -1;
  return guarded([&] {
    plugin->sound->hear(
        {context->notifications, static_cast<std::size_t>(context->notificationCount)});
    return 0;
  });
}
