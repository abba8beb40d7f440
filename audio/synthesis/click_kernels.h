#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/pulse.h"
#include "audio/radiation/radiation_filter.h"
#include "audio/synthesis/long_pulse.h"

namespace carom::audio {

/// The times on the samples and the gains of a pulse's instants: polynomials in u, the time in
/// contact durations since first touch.
struct ClickTrack {
  double start = 0.0;   ///< samples, time of u = 0
  double length = 0.0;  ///< samples, > 0, coefficient of u in the time
  double bend = 0.0;    ///< samples, of u^2: not 0 where the distance does not change evenly
  double gain = 0.0;    ///< gain at u = 0
  double slope = 0.0;   ///< coefficient of u in the gain
  double curve = 0.0;   ///< coefficient of u^2 in the gain

  double at(double u) const { return start + u * (length + u * bend); }
  double gainAt(double u) const { return gain + u * (slope + u * curve); }
};

/// Pulse nodes on the samples: each is a weighted sum of two neighbouring rows of the SpreadTable.
struct PlacedNodes {
  std::vector<std::int64_t> first;  ///< sample of the rows' first element
  std::vector<std::int64_t> row;    ///< index into the table of the first of the two rows
  std::vector<double> weight;       ///< weight of that row
  std::vector<double> nextWeight;   ///< weight of the next row
  /// Partial sums of the samples, one for each place (lane) that the begin of a row may have in a
  /// vector.
  std::vector<double> partial;

  /// Makes room for clicks of so many nodes and samples, and for what the kernels access beyond.
  void reserve(std::size_t nodes, std::size_t samples);
};

/// Samples [begin, end).
struct SampleRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// The elements [begin, end) of a filter's input that may differ from 0, counted from its first
/// element; negative before it.
struct HeldInput {
  std::ptrdiff_t begin = 0;
  std::ptrdiff_t end = 0;
};

/// The tap that falls on a raster's own sample in row 0.
inline constexpr std::size_t kRasterCentre = kSpreadWidth / 2 - 1;
/// The taps that turn row m of a raster into samples: spreadKernel(q - kRasterCentre - m / 2) at
/// [m][q].
using RasterTaps = std::array<std::array<double, kSpreadWidth>, Raster::kRows>;
const RasterTaps& rasterTaps();

/// The loops that take most of the run time, on buffers. Written once in plain C++, and once
/// vectorised for each instruction set that the compiler knows (Highway); all give the same result
/// up to rounding, and a sample the same bits wherever a buffer begins. [any thread] Nothing
/// allocates.
struct ClickKernels {
  /// Number of elements behind the end of `placed`, `x` and `to` that may be written too.
  static constexpr std::size_t kRoom = 32;
  /// Largest number of elements in a vector; buffers are padded for so many.
  static constexpr std::size_t kMostLanes = 8;
  static_assert(Pulse::kRulePadding + 1 >= kMostLanes);

  std::string_view name;  ///< name of the instruction set

  /// Places nodes, which are in order of time, along a track. Reads as many nodes behind the last
  /// one as fill the last vector; a rule of a Pulse has them (Pulse::kRulePadding).
  void (*place)(std::span<const PulseNode> nodes, const ClickTrack& track, PlacedNodes& placed);

  /// x = the sum of the first `count` placed nodes, which are in order of time.
  void (*spread)(PlacedNodes& placed, std::size_t count, std::span<double> x);

  /// Fills the raster's rows in `range`: force times gain along a track, as shares of the impulse.
  /// The track's bend is at most 1e-3 of its length. kRoom elements behind the range may be zeroed.
  void (*sample)(const ForceTable& force, const ClickTrack& track, SampleRange range,
                 Raster& raster);

  /// x[n] = the sum of the raster's values, each times the spreadKernel around it.
  void (*collect)(const Raster& raster, std::span<double> x);

  /// to[n] += from[n] * gain.
  void (*add)(std::span<const double> from, double gain, double* to);

  /// to[n] += sum over k of taps[k] from[n - k]. `from` reaches from kTaps - 1 elements in front to
  /// kRoom behind; only its elements in `held` may differ from 0.
  void (*filter)(const PaddedTaps& taps, const double* from, HeldInput held, std::span<double> to);

  /// to[n] = sum over k of taps[k] from[n - k]. Reads taps.size() - 1 elements in front of `from`,
  /// and kRoom behind to.size().
  void (*convolve)(std::span<const double> taps, const double* from, std::span<double> to);
};

/// The kernels in plain C++: the reference.
const ClickKernels& plainKernels();
/// The fastest kernels that this machine runs and this build has.
const ClickKernels& fastestKernels();
/// All kernels that this machine runs, the plain ones last: for tests and measurements.
std::span<const ClickKernels> allKernels();

}  // namespace carom::audio
