#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "carom/audio/surface_texture.h"
#include "carom/audio/synth.h"

namespace carom::test {

/// A steel ball that slides without turning over a floor of waves, along x, pressed down by `load`,
/// for half a second.
struct WavySlide {
  static constexpr double kRate = 48000.0;    ///< Hz, unless `sampleRate` says otherwise
  static constexpr double kWave = 0.002;      ///< m, of the floor
  static constexpr float kSteepness = 0.02F;  ///< 1, the largest slope
  static constexpr double kDuration = 0.5;    ///< s

  double speed = 1.0;         ///< m/s
  double load = 5.0;          ///< N: it follows the floor
  double step = 1.0 / 240.0;  ///< s, of the mechanics
  double sampleRate = kRate;  ///< Hz
  double radius = 0.005;      ///< m
  Vec3 listener = {0.25, 3.0, 1.0};
};

/// Waves along x of its own axes z or y.
std::shared_ptr<const SurfaceTexture> wavyFloor(float steepness = WavySlide::kSteepness);

/// Knows the ball (kBall) and the floor (kFloor); nothing is too quiet for it.
Synth synthOf(const WavySlide& slide);

/// Hands the whole slide over.
void play(Synth& synth, const WavySlide& slide);

std::vector<double> rendered(Synth& synth, std::size_t frames);
std::vector<double> soundOf(const WavySlide& slide);

/// Of the middle of the sound, with a Hann window: Pa, amplitude of a tone at that frequency (Hz).
double amplitudeAt(const std::vector<double>& sound, double frequency);
/// Hz, of the loudest tone between these.
double loudestFrequency(const std::vector<double>& sound, double low, double high);
double rms(const std::vector<double>& samples);

}  // namespace carom::test
