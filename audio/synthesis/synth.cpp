#include "carom/audio/synth.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "audio/propagation/sound_paths.h"
#include "audio/synthesis/click_renderer.h"
#include "audio/synthesis/contact_sound_scheduler.h"

namespace carom {

using namespace audio;

class Synth::Impl {
 public:
  explicit Impl(const std::shared_ptr<const SoundPaths>& paths) : layer_(paths), player_(paths) {}

  void schedule(const ImpulseEvent& event) { player_.add(layer_.lay(event)); }
  Status seek(double seconds);

  double rate() const { return layer_.paths().settings.sampleRate; }
  SynthCounters counters() const;

  ContactSoundScheduler layer_;
  ClickRenderer player_;
};

Status Synth::Impl::seek(double seconds) {
  if (!(std::abs(seconds) * rate() < kExactSamples))
    return Error{"synth: cannot seek to " + std::to_string(seconds) +
                 " s; the clock counts up to 2^53 samples"};
  player_.seek(std::llround(seconds * rate()));
  layer_.restartListeners();
  return std::monostate{};
}

SynthCounters Synth::Impl::counters() const {
  const ContactSoundCounters& laid = layer_.counters();
  return {.events = laid.events,
          .rings = laid.rings,
          .immovable = laid.immovable,
          .inaudible = laid.inaudible,
          .late = player_.counters().late,
          .undersampled = laid.undersampled,
          .rejected = laid.rejected,
          .slides = laid.slides,
          .inaudibleSlides = laid.inaudibleSlides};
}

Result<Synth> Synth::create(const SynthSettings& settings, std::vector<Listener> listeners) {
  auto paths = makeSoundPaths(settings, std::move(listeners));
  if (!paths) return Error{"synth: " + paths.error().message};
  return Synth(std::make_unique<Impl>(*paths));
}

Synth::Synth(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Synth::Synth(Synth&&) noexcept = default;
Synth& Synth::operator=(Synth&&) noexcept = default;
Synth::~Synth() = default;

Status Synth::setBody(BodyId id, const SoundBody& body) {
  return impl_->layer_.setBody(id, body);
}
Status Synth::moveListener(std::size_t listener, const ListenerPose& pose) {
  return impl_->layer_.moveListener(listener, pose);
}
void Synth::removeBody(BodyId id) {
  impl_->layer_.removeBody(id);
}
Status Synth::placeListener(std::size_t listener, const ListenerPose& pose) {
  return impl_->layer_.placeListener(listener, pose);
}
void Synth::schedule(const ImpulseEvent& event) {
  impl_->schedule(event);
}
void Synth::updateContact(const ContactState& contact) {
  impl_->player_.add(impl_->layer_.updateContact(contact));
  for (const bool first : {true, false})
    impl_->player_.add(impl_->layer_.slide(contact, first));
}
Status Synth::seek(double seconds) {
  return impl_->seek(seconds);
}
double Synth::time() const {
  return static_cast<double>(impl_->player_.position()) / impl_->rate();
}
double Synth::leadTime(double contactDuration) const {
  return impl_->layer_.leadTime(contactDuration);
}
double Synth::contactDuration(const ImpulseEvent& event) const {
  return impl_->layer_.contactDuration(event);
}
bool Synth::isSilent() const {
  return impl_->player_.isSilent();
}
const std::vector<Listener>& Synth::listeners() const {
  return impl_->layer_.paths().listeners;
}
std::size_t Synth::channelCount() const {
  return impl_->layer_.paths().channels.size();
}
double Synth::sampleRate() const {
  return impl_->rate();
}
SynthCounters Synth::counters() const {
  return impl_->counters();
}
std::size_t Synth::pendingClicks() const {
  return impl_->player_.pendingClicks();
}

template <class Sample>
void Synth::render(std::span<Sample* const> channels, std::size_t frames) noexcept {
  impl_->player_.render<Sample>(channels, frames);
}

template void Synth::render<float>(std::span<float* const>, std::size_t) noexcept;
template void Synth::render<double>(std::span<double* const>, std::size_t) noexcept;

}  // namespace carom
