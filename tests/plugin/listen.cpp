// listen FILE: prints a sound file's length, channels and peak; fails if it cannot be heard.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <sndfile.h>

namespace {

/// Least peak, relative to full scale; by default full scale is 20 Pa, so that this is 2 mPa, 40
/// dB.
constexpr double kQuietest = 1e-4;
/// Largest peak: no collision in the examples is louder in the air; NaN fails as well.
constexpr double kLoudest = 50.0;

std::vector<double> read(const char* path, SF_INFO& info) {
  SNDFILE* file = sf_open(path, SFM_READ, &info);
  if (file == nullptr) {
    std::fprintf(stderr, "%s: %s\n", path, sf_strerror(nullptr));
    return {};
  }
  std::vector<double> samples(static_cast<std::size_t>(info.frames * info.channels));
  sf_readf_double(file, samples.data(), info.frames);
  sf_close(file);
  return samples;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: listen FILE\n");
    return 2;
  }
  SF_INFO info = {};
  const std::vector<double> samples = read(argv[1], info);
  double peak = 0.0;
  bool finite = true;
  for (const double sample : samples) {
    finite = finite && std::isfinite(sample);
    peak = std::max(peak, std::abs(sample));
  }
  std::printf("%s: %.3f s, %d channels, peak %.4g\n", argv[1],
              static_cast<double>(info.frames) / std::max(info.samplerate, 1), info.channels, peak);
  return finite && peak >= kQuietest && peak <= kLoudest ? 0 : 1;
}
