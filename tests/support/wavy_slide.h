#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "carom/audio/surface_texture.h"
#include "carom/audio/synth.h"

namespace carom::test {

/// A steel ball that slides along x without turning over a floor of waves, pressed down by `load`,
/// for half a second.
struct WavySlide {
  static constexpr double kRate = 48000.0;    ///< Hz, unless `sampleRate` says otherwise
  static constexpr double kWave = 0.002;      ///< m, wavelength of the floor
  static constexpr float kSteepness = 0.02F;  ///< 1, the largest slope
  static constexpr double kDuration = 0.5;    ///< s

  double speed = 1.0;         ///< m/s
  double load = 5.0;          ///< N, large enough for the ball to follow the floor
  double step = 1.0 / 240.0;  ///< s, of the mechanics
  double sampleRate = kRate;  ///< Hz
  double radius = 0.005;      ///< m
  Vec3 listener = {0.25, 3.0, 1.0};
};

/// Waves that vary along x on a surface whose own normal is z, and along z if the normal is y.
std::shared_ptr<const SurfaceTexture> wavyFloor(float steepness = WavySlide::kSteepness);

/// Makes a synth with the ball (kBall) and the floor (kFloor), in which no sound is too quiet.
Synth synthOf(const WavySlide& slide);

/// Hands the contacts of the whole slide to the synth.
void play(Synth& synth, const WavySlide& slide);

std::vector<double> rendered(Synth& synth, std::size_t frames);
std::vector<double> soundOf(const WavySlide& slide);

/// Amplitude in Pa of the tone at `frequency` (Hz), in the middle of the sound under a Hann window.
double amplitudeAt(const std::vector<double>& sound, double frequency);
/// Frequency of the loudest tone between `low` and `high`, in Hz.
double loudestFrequency(const std::vector<double>& sound, double low, double high);
double rms(const std::vector<double>& samples);

}  // namespace carom::test
