#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "audio/propagation/sound_paths.h"
#include "carom/audio/impulse_event.h"
#include "plugin/pybullet/server_client.h"
#include "plugin/realtime/pressure_bounds.h"

namespace carom::plugin {

/// The impulse events of a simulation as rows of numbers, until they are taken: the columns of the
/// events CSV (docs/cli.md), with bodies and links as the server numbers them, and the bound of the
/// peak at each listener. [physics thread]
class EventTable {
 public:
  /// Columns before those of the listeners: time_s, body, link, other, other_link, jx_Ns, jy_Ns,
  /// jz_Ns, px_m, py_m, pz_m, nx, ny, nz, approach_speed_m_s, effective_mass_kg, duration_s,
  /// collision, peak_pa, heard.
  static constexpr std::size_t kColumns = 20;

  /// The peaks are those at the listeners of `paths`.
  explicit EventTable(const std::shared_ptr<const audio::SoundPaths>& paths);

  std::size_t columns() const { return kColumns + listeners_; }
  /// Takes bodies and the poses of listeners, as the scheduler of an output does.
  audio::ContactSoundScheduler& scheduler() { return bounds_.scheduler(); }
  /// Adds a share of a collision; the other one comes next, or came before.
  void add(const ImpulseEvent& share, ServerClient::Key body, ServerClient::Key other);

  std::size_t ready() const { return (rows_.size() - taken_) / columns(); }  ///< rows that wait
  /// Moves the oldest rows to `numbers`, as many as fit. Returns how many.
  std::size_t take(std::span<double> numbers);
  /// Forgets the rows that wait, and counts collisions anew.
  void clear();

 private:
  std::size_t listeners_;
  double threshold_;  // Pa, see SynthSettings::audibleThreshold
  PressureBounds bounds_;
  std::uint64_t shares_ = 0;
  std::vector<double> peaks_;  // Pa, scratch, by listener
  std::vector<double> rows_;
  std::size_t taken_ = 0;  // numbers of rows_ that are there no more
};

}  // namespace carom::plugin
