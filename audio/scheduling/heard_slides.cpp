#include "audio/scheduling/heard_slides.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace carom::audio {
namespace {

/// s: a contact that is earlier by so much is of a clock that has gone back.
constexpr double kEarlierClock = 0.1;
/// Ratio of powers below the threshold of hearing at which a contact makes no sound: 20 dB, so that
/// dozens of such contacts together are below it, too.
constexpr double kBelowHearing = 1e-2;
/// Share of the loudness of a moment, all contacts together, that may be left out as masked: it
/// changes the whole by 0.04 dB.
constexpr double kMaskedTogether = 1e-2;
/// Share of it that a single contact may have which is left out.
constexpr double kMaskedEach = 1e-3;
/// Factor on the loudness of a contact that has a voice: it is not given up for one that is hardly
/// louder.
constexpr double kKeeps = 2.0;

}  // namespace

void HeardSlides::begin(const ContactState& contact, const SampleShift& shift, SoundSink& sink) {
  if (isOpen_ && contact.time <= time_ && contact.time > time_ - kEarlierClock) return;
  close(sink);
  isOpen_ = true;
  time_ = contact.time;
  duration_ = contact.duration;
  shift_ = shift;
}

bool HeardSlides::isInaudible(double overHearing) {
  return overHearing < kBelowHearing;
}

HeardSlides::Fate HeardSlides::decide(const NoisePropagation& sound, bool isVoice) {
  if (isInaudible(sound.overHearing())) return Fate::inaudible;
  const double loudness = sound.loudness();
  now_ += loudness;
  if (!isVoice && loudness < kMaskedEach * total_ &&
      dropped_ + loudness < kMaskedTogether * total_) {
    dropped_ += loudness;
    return Fate::masked;
  }
  loudnesses_.push_back(loudness);
  const bool isLoud = loudness * (isVoice ? kKeeps : 1.0) >= least_;
  if (!isLoud || voices_ == 0) return Fate::bed;
  if (!isVoice) {
    // In a moment in which many contacts begin, none is known to be the loudest.
    if (before_ + fresh_ >= voices_ + voices_ / 2) return Fate::bed;
    ++fresh_;
  }
  ++taken_;
  return Fate::voice;
}

bool HeardSlides::takeVoice() {
  if (taken_ >= 2 * voices_) return false;
  ++taken_;
  return true;
}

void HeardSlides::addToBed(const NoisePropagation& sound, double share) {
  const std::span<const double> powers = sound.powers();
  powers_.resize(powers.size());
  for (std::size_t i = 0; i < powers.size(); ++i)
    powers_[i] += share * powers[i];
  power_ += share * sound.power();
  delay_ += share * sound.power() * sound.delay();
}

void HeardSlides::close(SoundSink& sink) {
  if (!isOpen_) return;
  isOpen_ = false;
  if (power_ > 0.0 || sounded_) {
    const double delay = power_ > 0.0 ? delay_ / power_ : 0.0;
    const std::int64_t since = shifted(samplesOf(time_, delay, sampleRate_), shift_).whole;
    const auto lasting = static_cast<std::int64_t>(
        std::max(1.0, std::ceil(duration_ * shift_.stretch * sampleRate_)));
    level_.assign(powers_.begin(), powers_.end());
    // Third octaves that are not heard cost nothing.
    for (std::size_t i = 0; i < level_.size(); ++i)
      if (powers_[i] < kBelowHearing * hearingThreshold()[i % kThirdOctaves]) level_[i] = 0.0F;
    sink.add(
        {.noise = {.at = since + lasting, .since = since, .lasting = lasting, .powers = level_}});
  }
  sounded_ = power_ > 0.0;
  std::ranges::fill(powers_, 0.0);
  power_ = delay_ = 0.0;
  least_ = 0.0;
  if (voices_ > 0 && loudnesses_.size() > voices_) {
    const auto last = loudnesses_.begin() + static_cast<std::ptrdiff_t>(voices_ - 1);
    std::ranges::nth_element(loudnesses_, last, std::ranges::greater{});
    least_ = *last;
  }
  loudnesses_.clear();
  before_ = taken_;
  total_ = now_;
  now_ = dropped_ = 0.0;
  taken_ = fresh_ = 0;
}

}  // namespace carom::audio
