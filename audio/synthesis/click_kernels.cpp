#include "audio/synthesis/click_kernels.h"

#include <algorithm>
#include <cmath>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/immortal.h"
#if CAROM_SIMD
#include "audio/synthesis/simd_kernels.h"
#endif

namespace carom::audio {
namespace {

constexpr double kPhases = static_cast<double>(SpreadTable::kPhases);

void place(std::span<const PulseNode> nodes, const ClickTrack& track, PlacedNodes& placed) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double left = track.at(nodes[i].u) - kSpreadHalfWidth;
    const double first = std::ceil(left);
    const double phase = (first - left) * kPhases;
    const double row = std::floor(phase);
    const double weight = nodes[i].weight * track.gainAt(nodes[i].u);
    placed.weight[i] = weight * (1.0 - (phase - row));
    placed.nextWeight[i] = weight * (phase - row);
    placed.first[i] = static_cast<std::int64_t>(first);
    placed.row[i] = static_cast<std::int64_t>(row);
  }
}

void spread(PlacedNodes& placed, std::size_t count, std::span<double> x) {
  std::fill(x.begin(), x.end(), 0.0);
  const SpreadTable& table = SpreadTable::instance();
  for (std::size_t i = 0; i < count; ++i) {
    const double* row = table.row(static_cast<std::size_t>(placed.row[i]));
    const double* next = row + SpreadTable::kStride;
    for (std::size_t m = 0; m < kSpreadWidth; ++m) {
      const auto at = static_cast<std::size_t>(placed.first[i]) + m;
      if (at < x.size()) x[at] += placed.weight[i] * row[m] + placed.nextWeight[i] * next[m];
    }
  }
}

void sample(const ForceTable& force, const ClickTrack& track, SampleRange range, Raster& raster) {
  const auto last = static_cast<double>(force.cells.size());
  const double curl = track.bend / track.length;
  for (std::size_t m = 0; m < Raster::kRows; ++m) {
    for (std::size_t n = range.begin; n < range.end; ++n) {
      const double time = static_cast<double>(n) + 0.5 * static_cast<double>(m);
      const double w = (time - track.start) / track.length;
      const double bent = curl * w;
      const double u = w * (1.0 - bent * (1.0 - 2.0 * bent));
      const double rate = 0.5 * (1.0 - bent * (2.0 - 6.0 * bent)) / track.length;
      const double place = (u - force.begin) * force.scale;
      double value = 0.0;
      if (place >= 0.0 && place < last) {
        const ForceTable::Cell& cell = force.cells[static_cast<std::size_t>(place)];
        value = (cell.value + cell.rise * (place - std::floor(place))) * track.gainAt(u) * rate;
      }
      raster.row(m)[n] = value;
    }
  }
}

void collect(const Raster& raster, std::span<double> x) {
  const RasterTaps& taps = rasterTaps();
  std::ranges::fill(x, 0.0);
  for (std::size_t m = 0; m < Raster::kRows; ++m) {
    for (std::size_t n = 0; n < x.size(); ++n) {
      const double* const from = raster.row(m) + n + kRasterCentre;
      for (std::size_t q = 0; q < taps[m].size(); ++q)
        x[n] += taps[m][q] * *(from - q);
    }
  }
}

void add(std::span<const double> from, double gain, double* to) {
  for (std::size_t i = 0; i < from.size(); ++i)
    to[i] += gain * from[i];
}

void filter(const PaddedTaps& taps, const double* from, HeldInput held, std::span<double> to) {
  constexpr auto kTaps = static_cast<std::ptrdiff_t>(PaddedTaps::kTaps);
  for (std::ptrdiff_t n = 0; n < std::ssize(to); ++n) {
    double sum = 0.0;
    for (std::ptrdiff_t i = std::max(held.begin, n - kTaps + 1); i < std::min(held.end, n + 1); ++i)
      sum += from[i] * taps.first()[n - i];
    to[static_cast<std::size_t>(n)] += sum;
  }
}

void convolve(std::span<const double> taps, const double* from, std::span<double> to) {
  for (std::size_t n = 0; n < to.size(); ++n) {
    double sum = 0.0;
    for (std::size_t tap = taps.size(); tap-- > 0;)
      sum += taps[tap] * *(from + n - tap);
    to[n] = sum;
  }
}

std::vector<ClickKernels> makeAll() {
  std::vector<ClickKernels> all;
#if CAROM_SIMD
  all = simdKernels();
#endif
  all.push_back({"plain", place, spread, sample, collect, add, filter, convolve});
  return all;
}

}  // namespace

void PlacedNodes::reserve(std::size_t nodes, std::size_t samples) {
  const std::size_t room = nodes + ClickKernels::kRoom;
  if (weight.size() < room) {
    first.resize(room);
    row.resize(room);
    nextWeight.resize(room);
    weight.resize(room);  // last, as its size tells that there is room in all
  }
  const std::size_t parts =
      ClickKernels::kMostLanes * (samples + kSpreadWidth + 2 * ClickKernels::kRoom);
  if (partial.size() < parts) partial.resize(parts);
}

const RasterTaps& rasterTaps() {
  static const RasterTaps taps = [] {
    RasterTaps made;
    for (std::size_t m = 0; m < made.size(); ++m) {
      for (std::size_t q = 0; q < made[m].size(); ++q)
        made[m][q] = spreadKernel(static_cast<double>(q) - static_cast<double>(kRasterCentre) -
                                  0.5 * static_cast<double>(m));
    }
    return made;
  }();
  return taps;
}

std::span<const ClickKernels> allKernels() {
  static const std::vector<ClickKernels>& all = immortal(makeAll);
  return all;
}

const ClickKernels& fastestKernels() {
  return allKernels().front();
}

const ClickKernels& plainKernels() {
  return allKernels().back();
}

}  // namespace carom::audio
