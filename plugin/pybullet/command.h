#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom::plugin {

/// The commands of p.executePluginCommand; see kCommandHelp.
namespace command {

struct PlaceListener {
  Vec3 position = Vec3::Zero();  ///< m, world frame
  Quat orientation = Quat::Identity();
};
struct SetMaterial {
  int body = 0;
  std::optional<int> link{};  ///< none: the base and all links
  std::string name;           ///< one of builtInMaterials
};
struct Record {
  std::filesystem::path file;
};
struct SetGain {
  double gain = 1.0;
};
struct Mute {
  bool on = true;
};
struct Play {};
struct Stop {};
struct Pause {};
struct Stats {};
struct Help {};

}  // namespace command

using Command = std::variant<command::PlaceListener, command::SetMaterial, command::Record,
                             command::SetGain, command::Mute, command::Play, command::Stop,
                             command::Pause, command::Stats, command::Help>;

inline constexpr std::string_view kCommandHelp =
    "listener X Y Z [QX QY QZ QW]   m, and how it is turned; without: looking along +y, z up\n"
    "material BODY [LINK] NAME      LINK -1 is the base; without: the base and all links\n"
    "record FILE                    a WAV file, from now until stop\n"
    "play                           on the default audio device\n"
    "stop                           ends both\n"
    "gain G                         factor on what is played, 0 to 1000\n"
    "mute on|off\n"
    "pause                          the simulation rests; its next step goes on\n"
    "stats                          counters, as NAME=NUMBER\n"
    "help";

/// Default orientation of a listener: PyBullet's worlds have z up.
Quat uprightOrientation();

/// Parses a command. Refuses any other text, and says what is wrong, and what would be accepted.
/// Does not know whether a body exists. [any thread]
Result<Command> parseCommand(std::string_view text);

}  // namespace carom::plugin
