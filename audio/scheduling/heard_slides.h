#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "audio/scheduling/noise_propagation.h"
#include "audio/scheduling/sample_time.h"
#include "audio/synthesis/scheduled_sound.h"
#include "carom/audio/contact_state.h"

namespace carom::audio {

/// Decides how each lasting contact of a moment is heard (LastingDetail::heard), and adds up those
/// that have no voice of their own. The decisions of a moment go by how loud the contacts of the
/// moment before were, so that each is made at once. [one thread]
class HeardSlides {
 public:
  /// The fate of a contact in a step.
  enum class Fate : std::uint8_t { voice, bed, masked, inaudible };

  HeardSlides(std::size_t voices, double sampleRate) : voices_(voices), sampleRate_(sampleRate) {}

  /// Begins the moment of a contact, if it is not the one in hand; that one is closed.
  void begin(const ContactState& contact, const SampleShift& shift, SoundSink& sink);
  /// Closes the moment in hand: its noise is a level of the bed from now on.
  void close(SoundSink& sink);

  /// True for a contact that is so far below the threshold of hearing, as a ratio of powers.
  static bool isInaudible(double overHearing);
  /// Decides for a contact of that sound; `isVoice` if it had a voice in the step before.
  Fate decide(const NoisePropagation& sound, bool isVoice);
  /// Adds a share of the sound to the noise that the bed reaches at the end of the step.
  void addToBed(const NoisePropagation& sound, double share);
  /// Takes a voice that nobody else can have in this moment; false if there are no more.
  bool takeVoice();

 private:
  std::size_t voices_;
  double sampleRate_;
  bool isOpen_ = false;
  double time_ = 0.0;      // s, of the moment
  double duration_ = 0.0;  // s, of its step
  SampleShift shift_;
  std::size_t taken_ = 0;           // voices of this moment
  std::size_t fresh_ = 0;           // of them, those that are new
  std::size_t before_ = 0;          // voices of the moment before
  double least_ = 0.0;              // loudness from which on a contact has a voice
  double total_ = 0.0;              // loudness of all contacts of the moment before
  double now_ = 0.0;                // loudness of all contacts of this moment
  double dropped_ = 0.0;            // loudness of those that are masked
  std::vector<double> loudnesses_;  // of this moment
  std::vector<double> powers_;      // Pa^2, of the bed, by channel and third octave
  std::vector<float> level_;        // the same, as it is sent
  double power_ = 0.0;              // Pa^2, of the bed
  double delay_ = 0.0;              // Pa^2 s, sum of delays by power
  bool sounded_ = false;            // the moment before had a bed
};

}  // namespace carom::audio
