#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "audio/run/host_run.h"
#include "audio/run/run_player.h"
#include "audio/run/run_portion.h"
#include "scenes/format/scene.h"
#include "scenes/live/number_table.h"

namespace carom::scenes {

/// Takes bytes that a page's manifest refers to, and returns their number.
using KeepBlob = std::function<std::size_t(std::span<const std::byte>)>;

/// A body in a picture, beside what the scene says of it.
struct DrawnBody {
  const audio::HostBody* body = nullptr;
  bool moves = false;
  ListenerPose pose = {};  ///< at time 0
};

/// Returns a body of the scene as it stands at time 0. [any thread]
DrawnBody drawnBody(const Scene& scene, const audio::HostBody& body);

/// Returns all of a scene that is drawn and that does not change: a run of a page's manifest
/// without its label, sound, events, poses and contacts. web/page/run/data.js reads it.
/// [any thread]
nlohmann::ordered_json sceneDrawing(const Scene& scene, std::span<const DrawnBody> bodies,
                                    const KeepBlob& keep);

/// Slip (m/s) below which a lasting contact is drawn as one that does not slide.
inline constexpr double kSlides = 1e-3;

/// Adds the row of an event: 14 doubles, with the impulse that is heard.
void addEventRow(const ImpulseEvent& event, const audio::RunPlayer::EventMeasure& measure,
                 ImpulseChoice choice, NumberTable& table);
/// Adds the row of a body's pose: 9 floats.
void addPoseRow(BodyId body, const ListenerPose& pose, NumberTable& table);

/// The part of a jello that is drawn: its outermost points and the squares between them.
class JelloOutline {
 public:
  explicit JelloOutline(const JelloShape& jello);

  /// Returns how the jello of a scene is drawn: its shape, and pictures of it, for a manifest.
  nlohmann::ordered_json drawing(const Scene& scene, std::span<const audio::JelloPicture> pictures,
                                 const KeepBlob& keep) const;
  /// Adds the places of the points in a picture, as floats.
  void addPoints(const audio::JelloPicture& picture, NumberTable& table) const;

 private:
  std::map<std::size_t, std::uint32_t> points_;  // of the lattice, by their numbers here
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_;
  std::vector<std::uint32_t> triangles_;
};

}  // namespace carom::scenes
