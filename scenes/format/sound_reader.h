#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "audio/propagation/pose_track.h"
#include "carom/audio/synth.h"
#include "modal/json/json_reader.h"
#include "scenes/format/scene.h"
#include "scenes/format/scene_folder.h"

namespace carom::scenes {

// The parts of a scene document that say how it sounds: "sound", "room" and a listener. Every error
// is recorded at its node, and what was read is then dropped with the scene. docs/scenes.md has the
// fields. All functions of this file: [any thread].

/// Most poses in the path of one listener: fewer than PoseTrack keeps at one time, since the poses
/// where it begins and where it comes to rest are added.
inline constexpr std::size_t kMaxPoses = 1000;

/// A plane of the scene, with the data that the room needs.
struct RoomPlane {
  std::string name;   ///< name of the body
  std::string entry;  ///< name of its entry: a box, or the plane itself
  /// The surface if "surfaces" does not name one; nullptr: unknown.
  const Surface* surface = nullptr;
  std::string material;
  Vec3 normal = Vec3::UnitY();  ///< unit, towards the air
  double offset = 0.0;          ///< m
};

/// One entry of "listeners", but for its name.
struct ListenerEntry {
  Listener listener;
  std::filesystem::path sofa;       ///< empty: the default head
  std::vector<ListenerPose> poses;  ///< empty: the listener stands still
};

/// Reads "sound".
void readSound(const modal::JsonNode& node, Scene& scene);

/// Reads "room" into `settings.room` and `settings.reverb`; its walls are the planes of the scene.
void readRoom(const modal::JsonNode& node, const std::vector<RoomPlane>& planes,
              double speedOfSound, SynthSettings& settings);

/// True if `entry` is an object with no key but a listener's.
bool expectListener(const modal::JsonNode& entry);

/// Reads a listener. File names are relative to `folder`.
ListenerEntry readListener(const modal::JsonNode& entry, const SceneFolder& folder);

}  // namespace carom::scenes
