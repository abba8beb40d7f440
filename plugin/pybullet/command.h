#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "carom/audio/absorption.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom::plugin {

/// The commands of p.executePluginCommand; see kCommandHelp.
namespace command {

/// Places a listener, or adds one. The parts that are set make it another receiver.
struct PlaceListener {
  Vec3 position = Vec3::Zero();  ///< m, world frame
  Quat orientation = Quat::Identity();
  std::size_t index = 0;  ///< as many as there are: adds one
  std::optional<ListenerFormat> format{};
  std::optional<double> spacing{};    ///< m
  std::optional<double> halfAngle{};  ///< rad
  std::optional<double> pattern{};    ///< 0 to 1
  std::filesystem::path head{};       ///< a SOFA file, makes it binaural; empty: none is named

  bool isOnlyMoved() const { return !format && !spacing && !halfAngle && !pattern && head.empty(); }
};
/// A body of the server, or one link of it.
struct Target {
  int body = 0;
  std::optional<int> link{};  ///< -1 is the base; none: the base and all links
};
struct SetMaterial {
  Target target{};
  std::string name;  ///< one of builtInMaterials
};
struct SetModes {
  Target target{};
  std::filesystem::path file{};  ///< empty: it does not ring
};
struct SetTexture {
  Target target{};
  Vec2 size = Vec2::Zero();      ///< m, of the whole picture
  std::filesystem::path file{};  ///< empty: the material's roughness
};
/// Sets the walls around: a box from `least` to `most` (m, world frame), or none.
struct SetRoom {
  bool isBox = false;
  Vec3 least = Vec3::Zero();
  Vec3 most = Vec3::Zero();
  Absorption absorption{};
  int order = 1;
  bool hasReverb = true;
};
/// Sets what a sample of 1.0 stands for in what is played and recorded.
struct SetLevel {
  std::optional<double> fullScale{};  ///< Pa; none: automatic
};
struct SetLatency {
  double seconds = 0.0;
};
struct Capture {};
struct Reset {
  double time = 0.0;  ///< s
};
struct Record {
  std::filesystem::path file;
};
struct RecordRun {
  std::filesystem::path file;
};
struct KeepRun {
  double seconds = 0.0;
};
struct SaveRun {
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
struct Report {};
struct Describe {};
struct TakeSamples {};
struct TakeEvents {};
struct Help {};

}  // namespace command

using Command =
    std::variant<command::PlaceListener, command::SetMaterial, command::SetModes,
                 command::SetTexture, command::SetRoom, command::SetLevel, command::SetLatency,
                 command::Capture, command::Reset, command::Record, command::RecordRun,
                 command::KeepRun, command::SaveRun, command::SetGain, command::Mute, command::Play,
                 command::Stop, command::Pause, command::Stats, command::Report, command::Describe,
                 command::TakeSamples, command::TakeEvents, command::Help>;

inline constexpr std::string_view kCommandHelp =
    "listener X Y Z [QX QY QZ QW] [index=N] [format=F] [spacing=M] [angle=RAD] [pattern=P] "
    "[head=FILE]\n"
    "                               m; without a quaternion it looks along +y, z up; the next "
    "index\n"
    "                               adds one; F: mono, spaced_pair, coincident_pair, binaural\n"
    "material BODY [LINK] NAME      LINK -1 is the base; without: the base and all links\n"
    "modes BODY [link=N] FILE|none  rings as a model file says\n"
    "texture BODY [link=N] WIDTH HEIGHT FILE, or BODY [link=N] none\n"
    "                               bumps from a normal map of that size (m)\n"
    "room X0 Y0 Z0 X1 Y1 Z1 [surface=S] [order=N] [reverb=on|off], or none\n"
    "                               a box of walls, m; S: a surface's name, or absorption 0 to 1\n"
    "level automatic|P              Pa that a sample of 1.0 is, played and recorded\n"
    "latency S                      s that played and taken samples are behind\n"
    "record FILE                    a WAV file, from now until stop\n"
    "play                           on the default audio device\n"
    "record-run FILE                what happens, for 'carom replay', from now until stop\n"
    "keep-run S                     keeps the last S seconds of it in memory; 0: no more\n"
    "save-run FILE                  writes what is kept\n"
    "stop                           ends playing and both recordings\n"
    "gain G                         factor on what is played, 0 to 1000\n"
    "mute on|off\n"
    "pause                          the simulation rests; its next step goes on\n"
    "capture                        keeps samples and events to be taken, from now on\n"
    "reset [T]                      all is silent, and the clock is at T (s), 0 if not given\n"
    "samples, events                take what is kept, as bytes: see docs/pybullet.md\n"
    "describe                       where samples are to be had, as NAME=VALUE\n"
    "stats                          counters, as NAME=NUMBER\n"
    "report                         in words what sounds, and why it is silent, quiet or loud\n"
    "help";

/// Default orientation of a listener: PyBullet's worlds have z up.
Quat uprightOrientation();

/// Parses a command. Refuses any other text, and says what is wrong, and what would be accepted.
/// Does not know whether a body exists. [any thread]
Result<Command> parseCommand(std::string_view text);

}  // namespace carom::plugin
