#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "audio/pose_track.h"
#include "carom/audio/synth.h"
#include "scenes/json_reader.h"

namespace carom::scenes {

// The parts of a scene document that say how it sounds: "sound", "room" and a listener. Every error
// is recorded at its node, and what was read is then dropped with the scene. docs/scenes.md has the
// fields. All of this file: [any thread].

/// How many poses the path of one listener may have: those that PoseTrack keeps at one time, less
/// where it begins and where it comes to rest.
inline constexpr std::size_t kMaxPoses = 1000;

/// A plane of the scene, as its room needs it.
struct RoomPlane {
  std::string name;   ///< of the body
  std::string entry;  ///< of what it came from: a box, or the plane itself
  /// What it is taken for where "surfaces" does not say; nullptr: unknown.
  const Surface* surface = nullptr;
  std::string material;
  Vec3 normal = Vec3::UnitY();  ///< unit, towards the air
  double offset = 0.0;          ///< m
};

/// What stands in one entry of "listeners", but for its name.
struct ListenerEntry {
  Listener listener;
  std::filesystem::path sofa;       ///< empty: the default head
  std::vector<ListenerPose> poses;  ///< empty: it stands
};

/// Reads "sound".
void readSound(const JsonNode& node, SynthSettings& settings);

/// Reads "room", of the planes that the scene has, into `settings.room` and `settings.reverb`.
void readRoom(const JsonNode& node, const std::vector<RoomPlane>& planes, double speedOfSound,
              SynthSettings& settings);

/// Whether `entry` is an object with no key but a listener's.
bool expectListener(const JsonNode& entry);

/// Reads a listener. File names are relative to `folder`.
ListenerEntry readListener(const JsonNode& entry, const std::filesystem::path& folder);

}  // namespace carom::scenes
