#include "carom/audio/synth.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "audio/propagation/sound_paths.h"
#include "audio/scheduling/contact_sound_scheduler.h"
#include "audio/scheduling/stem_renderers.h"

namespace carom {

using namespace audio;

class Synth::Impl {
 public:
  explicit Impl(const std::shared_ptr<const SoundPaths>& paths)
      : paths_(paths), scheduler_(paths), renderers_(paths) {}

  Status seek(double seconds);
  double rate() const { return scheduler_.paths().settings.sampleRate; }
  SynthCounters counters() const {
    SynthCounters sum = scheduler_.counters() + renderers_.whole().counters();
    sum.lost += lost_;
    return sum;
  }

  std::shared_ptr<const SoundPaths> paths_;
  ContactSoundScheduler scheduler_;
  StemRenderers renderers_;
  std::uint64_t lost_ = 0;  // events that were dropped by `seek`
};

Status Synth::Impl::seek(double seconds) {
  if (!(std::abs(seconds) * rate() < kExactSamples))
    return Error{"synth: cannot seek to " + std::to_string(seconds) +
                 " s; the clock counts up to 2^53 samples"};
  lost_ += waitingEvents(counters());
  renderers_.seek(std::llround(seconds * rate()));
  scheduler_.restart();
  return std::monostate{};
}

Result<Synth> Synth::create(const SynthSettings& settings, std::vector<Listener> listeners) {
  auto paths = makeSoundPaths(settings, std::move(listeners));
  if (!paths) return Error{"synth: " + paths.error().message};
  return Synth(std::make_unique<Impl>(*paths));
}

Synth Synth::fresh() const {
  return Synth(std::make_unique<Impl>(impl_->paths_));
}

Synth::Synth(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Synth::Synth(Synth&&) noexcept = default;
Synth& Synth::operator=(Synth&&) noexcept = default;
Synth::~Synth() = default;

Status Synth::setBody(BodyId id, const SoundBody& body) {
  return impl_->scheduler_.setBody(id, body);
}
Status Synth::moveListener(std::size_t listener, const ListenerPose& pose) {
  return impl_->scheduler_.moveListener(listener, pose);
}
void Synth::removeBody(BodyId id) {
  impl_->scheduler_.removeBody(id);
}
Status Synth::placeListener(std::size_t listener, const ListenerPose& pose) {
  return impl_->scheduler_.placeListener(listener, pose);
}
double Synth::schedule(const ImpulseEvent& event) {
  const std::uint64_t before = impl_->scheduler_.counters().events;
  impl_->scheduler_.schedule(event, {}, impl_->renderers_);
  const bool sounds = impl_->scheduler_.counters().events > before;
  return sounds ? impl_->scheduler_.lastPeak() : 0.0;
}
Status Synth::moveBody(BodyId id, const ListenerPose& pose) {
  return impl_->scheduler_.moveBody(id, pose);
}

void Synth::advanceTo(double time) {
  impl_->scheduler_.advanceTo(time, {}, impl_->renderers_);
}

void Synth::updateContact(const ContactState& contact) {
  impl_->scheduler_.updateContact(contact, {}, impl_->renderers_);
}
Status Synth::seek(double seconds) {
  return impl_->seek(seconds);
}
double Synth::time() const {
  return static_cast<double>(impl_->renderers_.whole().position()) / impl_->rate();
}
double Synth::leadTime(double contactDuration) const {
  return impl_->scheduler_.leadTime(contactDuration);
}
double Synth::contactDuration(const ImpulseEvent& event) const {
  return impl_->scheduler_.contactDuration(event);
}
bool Synth::isSilent() const {
  return impl_->renderers_.whole().isSilent();
}
const std::vector<Listener>& Synth::listeners() const {
  return impl_->scheduler_.paths().listeners;
}
std::size_t Synth::channelCount() const {
  return impl_->renderers_.channelCount();
}
double Synth::sampleRate() const {
  return impl_->rate();
}
SynthCounters Synth::counters() const {
  return impl_->counters();
}
ContactEnergy Synth::contactEnergy(double time) const {
  return impl_->scheduler_.contactEnergy(time);
}
std::size_t Synth::pendingClicks() const {
  return impl_->renderers_.whole().pendingClicks();
}

SynthCounters& operator+=(SynthCounters& sum, const SynthCounters& more) {
  for (const auto count : {&SynthCounters::events,
                           &SynthCounters::rings,
                           &SynthCounters::immovable,
                           &SynthCounters::inaudible,
                           &SynthCounters::late,
                           &SynthCounters::undersampled,
                           &SynthCounters::rejected,
                           &SynthCounters::slides,
                           &SynthCounters::inaudibleSlides,
                           &SynthCounters::stolen,
                           &SynthCounters::overBudget,
                           &SynthCounters::noBus,
                           &SynthCounters::tooLong,
                           &SynthCounters::modalVoicesExhausted,
                           &SynthCounters::slidesLeftOut,
                           &SynthCounters::slidesInBed,
                           &SynthCounters::maskedSlides,
                           &SynthCounters::masked,
                           &SynthCounters::rejectedNotFinite,
                           &SynthCounters::rejectedUnknownBody,
                           &SynthCounters::rejectedNoContact,
                           &SynthCounters::rejectedTooLong,
                           &SynthCounters::rejectedTooFar,
                           &SynthCounters::heard,
                           &SynthCounters::lost,
                           &SynthCounters::ringsLeftOut,
                           &SynthCounters::rejectedSlides,
                           &SynthCounters::silencedFrames})
    sum.*count += more.*count;
  return sum;
}

std::uint64_t waitingEvents(const SynthCounters& counters) {
  return counters.events - (counters.heard + counters.inaudible + counters.masked +
                            counters.stolen + counters.overBudget + counters.noBus +
                            counters.tooLong + counters.ringsLeftOut + counters.lost);
}

template <class Sample>
void Synth::render(std::span<Sample* const> channels, std::size_t frames) noexcept {
  impl_->scheduler_.finishMoment(impl_->renderers_);
  impl_->renderers_.render<Sample>(channels, frames);
}

template void Synth::render<float>(std::span<float* const>, std::size_t) noexcept;
template void Synth::render<double>(std::span<double* const>, std::size_t) noexcept;

}  // namespace carom
