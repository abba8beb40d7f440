#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "audio/pulse.h"
#include "audio/radiation_filter.h"

namespace carom {

/// Where the instants of a pulse fall on the samples, and how loud: polynomials in u, the time in
/// contact durations since first touch.
struct ClickTrack {
  double start = 0.0;   ///< samples, of u = 0
  double length = 0.0;  ///< samples, > 0
  double bend = 0.0;    ///< samples, of u^2: where the distance does not change evenly
  double gain = 0.0;    ///< of u = 0
  double slope = 0.0;   ///< of u
  double curve = 0.0;   ///< of u^2

  double at(double u) const { return start + u * (length + u * bend); }
  double gainAt(double u) const { return gain + u * (slope + u * curve); }
};

/// What pulse nodes become on the samples: two neighbouring rows of the SpreadTable each, weighted.
struct PlacedNodes {
  std::vector<std::int64_t> first;  ///< sample of the rows' first element
  std::vector<std::int64_t> row;    ///< index into the table, of the first of the two
  std::vector<double> weight;       ///< of that row
  std::vector<double> nextWeight;   ///< of the next row

  void resize(std::size_t count);  ///< with the room that the kernels need
};

/// The loops in which the time goes, on buffers. Written once in plain C++, and once vectorised
/// for each instruction set that the compiler knows (Highway); all give the same result up to
/// rounding, and a sample the same bits wherever a buffer begins. [any thread] Nothing allocates.
struct ClickKernels {
  /// Elements behind the end of `placed`, `x` and `to` that may be written too.
  static constexpr std::size_t kRoom = 32;

  std::string_view name;  ///< of the instruction set

  /// Lays nodes, in order of time, along a track.
  void (*place)(std::span<const PulseNode> nodes, const ClickTrack& track, PlacedNodes& placed);

  /// x = the sum of the first `count` placed nodes.
  void (*spread)(const PlacedNodes& placed, std::size_t count, std::span<double> x);

  /// to[n] += from[n] * gain.
  void (*add)(std::span<const double> from, double gain, double* to);

  /// to[n] += sum over k of taps[k] from[n - k], for 0 <= n < count. Reads taps.size() - 1
  /// elements in front of `from`, and kRoom behind what it needs.
  void (*filter)(const double* from, std::span<const double> taps, double* to, std::size_t count);
};

/// The plain ones: the reference.
const ClickKernels& plainKernels();
/// The fastest that this machine runs and this build has.
const ClickKernels& fastestKernels();
/// All of them, the plain ones last: for tests and measurements.
std::span<const ClickKernels> allKernels();

}  // namespace carom
