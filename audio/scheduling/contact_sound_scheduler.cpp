#include "audio/scheduling/contact_sound_scheduler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/hertz.h"
#include "audio/model/positive.h"
#include "audio/radiation/radiation_filter.h"

namespace carom::audio {
namespace {

/// Samples: shorter contacts alias if they are sampled naively; docs/acceleration_noise.md has the
/// error.
constexpr double kWellSampled = 4.0;
/// Factor in ContactSoundScheduler::slideRank for a contact that slides already: it is not given up
/// for one that is hardly louder.
constexpr double kSlidesOn = 2.0;
/// m: least distance to a listener in ContactSoundScheduler::slideRank.
constexpr double kNearest = 0.1;

/// Steps for which a contact that was too quiet is not looked at again, and how much louder it may
/// have become meanwhile.
constexpr int kRestingSteps = 8;
constexpr double kLouder = 1.5;

/// s by which a damping waits at most for a ring that is on its way.
constexpr double kLongestDelay = 60.0;

/// Lets a contact that is too quiet rest.
void letRest(const ContactState& contact, Slide& slide) {
  slide.rest = {.steps = kRestingSteps,
                .fastest = kLouder * kLouder * squaredWay(contact),
                .heaviest = kLouder * contact.normalLoad};
}

/// Tolerance of the length of an event's orientation: that of a quaternion in float that has been
/// turned for long. Impulses grow by its square.
constexpr double kUnitOrientation = 0.01;

bool isUnit(const Quat& orientation) {
  return std::abs(orientation.norm() - 1.0) <= kUnitOrientation;
}

bool isFinite(const ImpulseEvent& event) {
  const bool hasOther =
      !event.hasOtherPose || (event.otherPosition.allFinite() && isUnit(event.otherOrientation));
  return hasOther && std::isfinite(event.time) && event.impulse.allFinite() &&
         event.position.allFinite() && event.normal.allFinite() && event.bodyPosition.allFinite() &&
         isUnit(event.bodyOrientation) && event.bodyVelocity.allFinite() &&
         event.bodyAngularVelocity.allFinite() && std::isfinite(event.approachSpeed) &&
         std::isfinite(event.effectiveMass) && !std::isnan(event.radius) &&
         !std::isnan(event.otherRadius);
}

/// Returns a shift for what comes so many samples later on the clock than it would by its time.
SampleShift later(const SampleShift& shift, double samples) {
  const double sum = shift.fraction + samples;
  const double whole = std::floor(sum);
  return {shift.whole + static_cast<std::int64_t>(whole), sum - whole, shift.stretch};
}

}  // namespace

ContactSoundScheduler::ContactSoundScheduler(std::shared_ptr<const SoundPaths> paths)
    : paths_(std::move(paths)),
      settings_(paths_->settings),
      listeners_(paths_),
      exciter_(paths_),
      bodies_(paths_, exciter_),
      durations_(settings_),
      coupled_(settings_.sampleRate),
      propagation_(paths_, listeners_, exciter_),
      slides_(bodies_),
      rings_(paths_, listeners_, exciter_),
      noise_(paths_, listeners_),
      heard_(settings_.slideVoices, settings_.sampleRate),
      choosesSlides_(settings_.lasting == LastingDetail::heard && !paths_->hasHeads &&
                     settings_.comparison.radiation == Radiation::exact &&
                     settings_.comparison.sampling == Sampling::bandLimited) {}

void ContactSoundScheduler::removeBody(BodyId id) {
  for (const ModalExciter::Damped& damped : exciter_.forgetContacts(id)) {
    const SoundingBody* const body = bodies_.find(damped.body);
    if (body != nullptr && body->modes != nullptr)
      released_.emplace_back(damped, body->modes->resonators);
  }
  if (std::ranges::none_of(released_, [id](const auto& each) { return each.first.body == id; }))
    exciter_.forgetChanges(id);
  bodies_.remove(id);
  slides_.forget(id);
  coupled_.forget(id);
  rings_.forget(id);
}

Status ContactSoundScheduler::moveBody(BodyId id, const ListenerPose& pose) {
  const SoundingBody* body = bodies_.find(id);
  if (body == nullptr) return Error{"synth: there is no body " + std::to_string(id)};
  if (body->modes == nullptr || rings_.move(id, pose)) return std::monostate{};
  return Error{
      "synth: pose of body " + std::to_string(id) + " at " + std::to_string(pose.time) +
      " s: expected finite values, a unit quaternion and a later time than the last pose's"};
}

double ContactSoundScheduler::contactDuration(const ImpulseEvent& event) const {
  const SoundingBody* body = bodies_.find(event.body);
  const SoundingBody* other = bodies_.find(event.other);
  if (body == nullptr || other == nullptr) return 0.0;
  return durations_.durationOf(event, body->sound, other->sound);
}

double ContactSoundScheduler::leadTime(double contactDuration) const {
  const double pulse = -Pulse::of(settings_.comparison.pulse).begin() * contactDuration;
  constexpr auto kReach = static_cast<std::int64_t>(kSpreadWidth / 2);
  // The 2 stands for the whole samples that the pulse falls between.
  const auto filter = static_cast<double>(kReach - RadiationFilter::kFirstTap + 2);
  return pulse + filter / settings_.sampleRate + paths_->earliestEar;
}

void ContactSoundScheduler::schedule(const ImpulseEvent& event, const SampleShift& shift,
                                     SoundSink& sink) {
  if (settings_.impulse != ImpulseChoice::applied || !event.hasAppliedImpulse)
    return scheduleImpulse(event, shift, sink);
  ImpulseEvent applied = event;
  applied.impulse = event.appliedImpulse;
  scheduleImpulse(applied, shift, sink);
}

void ContactSoundScheduler::scheduleImpulse(const ImpulseEvent& event, const SampleShift& shift,
                                            SoundSink& sink) {
  if (!isFinite(event)) return reject(&SynthCounters::rejectedNotFinite);
  if (!released_.empty()) undampReleased(event.time, shift, sink);
  if (bodies_.find(event.body) == nullptr || bodies_.find(event.other) == nullptr)
    return reject(&SynthCounters::rejectedUnknownBody);
  const double duration = contactDuration(event);
  if (!isPositive(duration)) return reject(&SynthCounters::rejectedNoContact);
  const SoundingBody& body = *bodies_.find(event.body);
  if (body.isSilent()) {
    ++counters_.immovable;
    return;
  }
  const CoupledImpacts::Course* course = courseOf(event);
  const double rings = course != nullptr ? course->rings : 1.0;
  if (body.modes != nullptr) rings_.advance(event.body, {event.time, shift, sink});
  ContactSource source = sourceOf(event, body, rings);
  source.ringShare = rings;
  source.duration = course != nullptr ? course->duration : duration;
  source.touch = duration;
  source.shift = shift;
  source.pulse = &durations_.pulseOf(event);
  if (course != nullptr) source.train = course->nodes;
  if (body.recoil != nullptr) {
    source.recoil = body.recoil.get();
    source.motion = impactMotion(event, body.sound);
    source.orientation = event.bodyOrientation;
    source.ahead = body.recoil->radius();
  }
  source.isFollowed = source.rings && rings_.follows(event);
  if (!propagation_.propagate(source)) return reject(propagation_.refusal());
  ++counters_.events;
  if (settings_.comparison.sampling == Sampling::naive &&
      duration * settings_.sampleRate < kWellSampled)
    ++counters_.undersampled;
  ScheduledSound sound = propagation_.sound();
  sound.isEvent = true;
  sound.train = source.train;
  if (!sound.excitations.empty()) ++counters_.rings;
  const bool isLive = rings_.isLive();
  if ((source.isFollowed || isLive) && !sound.excitations.empty())
    rings_.add(
        {.event = event,
         .sound = body.sound,
         .source = *body.modes,
         .middle = source.time + 0.5 * source.duration / shift.stretch,
         .until = source.time + source.duration +
                  (isLive ? exciter_.longestRingAnywhere() : exciter_.longestRing()) / stretch_,
         .peak = sound.modalPeak,
         .shift = shift});
  if (sound.clicks.empty() && sound.excitations.empty())
    ++counters_.inaudible;
  else if (isHeard(source, sound))
    sink.add(sound);
}

/// True if a click is heard beside those before it; counts it if it is not.
bool ContactSoundScheduler::isHeard(const ContactSource& source, const ScheduledSound& sound) {
  // The tail of a reverberation has more energy than the click, and rings more than it.
  if (!choosesSlides_ || settings_.reverb || !sound.excitations.empty()) return true;
  const double across = 2.0 * source.strike.radius / settings_.medium.speedOfSound;
  const auto fate = heardClicks_.decide(
      {.time = source.time, .peak = sound.peak, .duration = source.duration + across});
  if (fate == HeardClicks::Fate::inaudible) ++counters_.inaudible;
  if (fate == HeardClicks::Fate::masked) ++counters_.masked;
  return fate == HeardClicks::Fate::heard;
}

void ContactSoundScheduler::reject(std::uint64_t SynthCounters::*reason) {
  ++counters_.rejected;
  ++(counters_.*reason);
}

/// Returns the course of an impact in which modes take part; null for one of rigid bodies.
const CoupledImpacts::Course* ContactSoundScheduler::courseOf(const ImpulseEvent& event) {
  const bool isCoupled =
      settings_.ringingContact == RingingContact::coupled && paths_->isFiltered();
  if (!isCoupled || settings_.comparison.sampling == Sampling::naive) return nullptr;
  return coupled_.courseOf(event, *bodies_.find(event.body), *bodies_.find(event.other));
}

/// Returns the source of an impulse, without its duration, pulse and shift, and begins the
/// excitation of the body's modes by a share `rings` of it.
ContactSource ContactSoundScheduler::sourceOf(const ImpulseEvent& event, const SoundingBody& body,
                                              double rings) {
  ContactSource source{.time = event.time,
                       .strike = makeStrike(event, body.sound, settings_.medium),
                       .filters = body.filters};
  source.dipoleBefore = source.strike.dipole;
  if (settings_.comparison.radiation == Radiation::exact)
    source.ahead = std::min(source.strike.radius, kLargestFilteredRadius);
  if (body.modes == nullptr) return source;
  ImpulseEvent ringing = event;
  ringing.impulse *= rings;
  if (!exciter_.strike(ringing, body.sound, *body.modes)) return source;
  source.rings = true;
  if (body.filters == nullptr) {
    source.strike.position = exciter_.position();
    source.strike.radius = exciter_.radius();  // receivers count as outside of the body
    source.ahead = 0.0;
  }
  return source;
}

/// Schedules that bodies ring freely again of which what has damped them has been removed, or which
/// have been removed themselves.
void ContactSoundScheduler::undampReleased(double time, const SampleShift& shift, SoundSink& sink) {
  for (const auto& [damped, modes] : std::exchange(released_, {})) {
    const std::optional<std::int64_t> sample = dampedFrom(time, damped.place, shift);
    if (!sample) continue;
    exciter_.undamp(damped.body, *modes, *sample);
    if (bodies_.find(damped.body) != nullptr)
      coupled_.damp(damped.body, *modes, time, exciter_.addedDamping(damped.body, *modes));
    sink.add({.excitations = exciter_.excitations(), .taps = exciter_.taps()});
    if (bodies_.find(damped.body) == nullptr) exciter_.forgetChanges(damped.body);
  }
}

/// Returns the sample from which on what touches a body at a place (m) is heard in its ring; none
/// if it is beyond the clock. A damping is heard as late as the ring that it damps. The banks of
/// all channels take it at once, so that the way to the nearest listener counts.
std::optional<std::int64_t> ContactSoundScheduler::dampedFrom(double time, const Vec3& place,
                                                              const SampleShift& shift) {
  const double way = listeners_.nearestDistance(time, place);
  const double delay =
      std::isfinite(way) ? std::min(way / settings_.medium.speedOfSound, kLongestDelay) : 0.0;
  const double rate = settings_.sampleRate;
  if (!((std::abs(time) + delay) * rate < kExactSamples)) return std::nullopt;
  return shifted(samplesOf(time, delay, rate), shift).whole;
}

void ContactSoundScheduler::updateContact(const ContactState& contact, const SampleShift& shift,
                                          SoundSink& sink) {
  damp(contact, shift, sink);
  updateSlide(contact, shift, sink);
}

void ContactSoundScheduler::updateDamping(const ContactState& contact, const SampleShift& shift,
                                          SoundSink& sink) {
  damp(contact, shift, sink);
  slides_.end(contact);
}

void ContactSoundScheduler::damp(const ContactState& contact, const SampleShift& shift,
                                 SoundSink& sink) {
  if (!released_.empty()) undampReleased(contact.time, shift, sink);
  if (!bodies_.anyModes()) return;  // quickly, as worlds have many contacts
  const bool isFinite = std::isfinite(contact.time) && contact.pathStart.allFinite() &&
                        contact.otherPathStart.allFinite() && contact.normalLoad >= 0.0;
  if (!isFinite || settings_.contactLoss == 0.0 || !rings(contact)) return;
  const std::optional<std::int64_t> sample = dampedFrom(contact.time, contact.position, shift);
  if (!sample) return;
  for (const bool first : {true, false})
    if (updateModes(contact, first, *sample)) {
      const BodyId body = first ? contact.body : contact.other;
      const ResonatorSet& modes = *bodies_.find(body)->modes->resonators;
      coupled_.damp(body, modes, contact.time, exciter_.addedDamping(body, modes));
      sink.add({.excitations = exciter_.excitations(), .taps = exciter_.taps()});
    }
}

/// Makes the change of damping of the contact's first body, or of the other one, the exciter's only
/// excitation; false if nothing changes.
bool ContactSoundScheduler::updateModes(const ContactState& contact, bool first,
                                        std::int64_t sample) {
  const BodyId id = first ? contact.body : contact.other;
  const BodyId otherId = first ? contact.other : contact.body;
  const SoundingBody* body = bodies_.find(id);
  const SoundingBody* other = bodies_.find(otherId);
  if (body == nullptr || other == nullptr || body->modes == nullptr) return false;
  const ModalModel& model = *body->sound.modal;
  const Vec3& point = first ? contact.pathStart : contact.otherPathStart;
  const bool isOver = contact.phase == ContactPhase::end;
  const double stiffness = isOver ? 0.0 : hertzStiffness(hertzContact(contact, *body, *other));
  return exciter_.updateContact(
      {.body = id,
       .other = otherId,
       .point = point + body->sound.modalOrigin.value_or(model.centreOfMass),
       .stiffness = stiffness,
       .mass = other->sound.mass,
       .place = contact.position},
      *body->modes, sample);
}

double ContactSoundScheduler::slideRank(const ContactState& contact) {
  const double loudest =
      bodies_.anyTexture() ? slides_.steepestImpulse(contact, settings_.sampleRate) : 0.0;
  if (loudest == 0.0) return 0.0;
  const double nearest = listeners_.nearestDistance(contact.time, contact.position);
  const bool slides = slides_.isSliding(contact);
  return (slides ? kSlidesOn : 1.0) * loudest / std::max(nearest, kNearest);
}

void ContactSoundScheduler::updateSlide(const ContactState& contact, const SampleShift& shift,
                                        SoundSink& sink) {
  // The naive compact model has no filter that could take a force.
  if (!bodies_.anyTexture() || !paths_->isFiltered()) return;
  if (!(shift.stretch > kLeastStretch && shift.stretch < kMostStretch)) return;
  if (choosesSlides_) return hearSlide(contact, shift, sink);
  const double loudest = slides_.steepestImpulse(contact, settings_.sampleRate);
  if (loudest == 0.0) return slides_.end(contact);
  if (isInaudible(contact, loudest)) {
    ++counters_.inaudibleSlides;
    return slides_.end(contact);
  }
  Slide& slide = slides_.advance(contact, shift.stretch * settings_.sampleRate);
  if (slide.nodes.empty()) return;
  for (const bool first : {true, false})
    scheduleSlide({contact, shift, slide, nullptr}, first, sink);
}

bool ContactSoundScheduler::rings(const ContactState& contact) const {
  const auto rings = [this](BodyId id) {
    const SoundingBody* const body = bodies_.find(id);
    return body != nullptr && body->modes != nullptr;
  };
  return rings(contact.body) || rings(contact.other);
}

/// Schedules a step of a contact as much as it is heard.
void ContactSoundScheduler::hearSlide(const ContactState& contact, const SampleShift& shift,
                                      SoundSink& sink) {
  if (slides_.restsOn(contact)) {
    ++counters_.inaudibleSlides;
    return;
  }
  if (contact.phase != ContactPhase::end && isValid(contact, settings_.sampleRate))
    heard_.begin(contact, shift, sink);
  Slide* const slide = slides_.find(contact, settings_.sampleRate);
  if (slide == nullptr) return;
  slide->rest.steps = 0;
  const ContactDrive::Step drive = slides_.stepOf(contact, shift.stretch * settings_.sampleRate);
  const SlideStep step{contact, shift, *slide, &drive};
  if (bodies_.anyModes() && rings(contact)) return hearRinging(step, sink);
  if (slide->voice == 0.0) {
    if (!SlideTracker::follow(contact, drive, *slide)) return;
  } else {
    SlideTracker::advance(contact, drive, *slide, false);
    if (slide->nodes.empty()) {
      slide->voice = 0.0;
      return;
    }
  }
  if (estimate(step)) return sound(step, sink);
  ++counters_.inaudibleSlides;
  letRest(contact, *slide);
  slide->isHeard = true;
}

/// Gives a voice to the contact of a body that rings, which may gather energy for longer than a
/// step.
void ContactSoundScheduler::hearRinging(const SlideStep& step, SoundSink& sink) {
  if (!heard_.takeVoice()) {
    ++counters_.slidesLeftOut;
    return slides_.end(step.contact);
  }
  SlideTracker::advance(step.contact, *step.drive, step.slide, false);
  if (step.slide.nodes.empty()) return;
  for (const bool first : {true, false})
    scheduleSlide(step, first, sink);
}

/// Finds what is heard of a contact, as noise; false if that is nothing, and it has no voice.
bool ContactSoundScheduler::estimate(const SlideStep& step) {
  const ContactState& contact = step.contact;
  BandPowers force;
  estimateForce(step.slide.drive.contact(contact.duration), force);
  std::array<Strike, 2> strikes;
  std::size_t count = 0;
  for (const bool first : {true, false}) {
    const SoundingBody& body = *bodies_.find(first ? contact.body : contact.other);
    if (body.isSilent()) continue;
    strikes[count++] = makeStrike(
        SlideTracker::unitImpulse(contact, first, step.slide.sides[first ? 0 : 1].offset),
        body.sound, settings_.medium);
  }
  const std::span<const Strike> pushed = std::span(strikes).first(count);
  if (step.slide.voice == 0.0 &&
      HeardSlides::isInaudible(noise_.boundOverHearing(contact.time, pushed, force)))
    return false;
  noise_.propagate(contact.time, pushed, force);
  return true;
}

/// Schedules the share of a step that has a voice, and adds the rest to the bed of noise.
void ContactSoundScheduler::sound(const SlideStep& step, SoundSink& sink) {
  Slide& slide = step.slide;
  const double before = slide.voice;
  const HeardSlides::Fate fate = heard_.decide(noise_, before > 0.0);
  slide.voice = fate == HeardSlides::Fate::voice ? 1.0 : 0.0;
  if (fate == HeardSlides::Fate::inaudible || fate == HeardSlides::Fate::masked) {
    ++(fate == HeardSlides::Fate::masked ? counters_.maskedSlides : counters_.inaudibleSlides);
    letRest(step.contact, slide);
  }
  if (fate == HeardSlides::Fate::bed) {
    heard_.addToBed(noise_, 1.0);
    ++counters_.slidesInBed;
  }
  const bool isNew = !slide.isHeard;
  slide.isHeard = true;
  if (before == 0.0 && slide.voice == 0.0) return;
  if (before == 0.0) SlideTracker::advance(step.contact, *step.drive, slide, true);
  if (slide.nodes.empty()) return;
  // Powers of train and noise add up to that of the contact.
  const double from = isNew ? 1.0 : before;
  if (from != 1.0 || slide.voice != 1.0)
    for (PulseNode& node : slide.nodes)
      node.weight *= std::sqrt(from + node.u * (slide.voice - from));
  for (const bool first : {true, false})
    scheduleSlide(step, first, sink);
}

/// Schedules the share of the contact's first body, or of the other one: in parts if it lasts too
/// long for one sound.
void ContactSoundScheduler::scheduleSlide(const SlideStep& step, bool first, SoundSink& sink) {
  if (bodies_.find(first ? step.contact.body : step.contact.other)->isSilent()) return;
  const double lasting = step.contact.duration * step.shift.stretch;
  const auto parts = static_cast<std::size_t>(std::max(1.0, std::ceil(lasting / longestStep_)));
  if (parts == 1) return schedulePart(step, first, {0, 1, step.slide.nodes}, sink);
  auto node = step.slide.nodes.begin();
  for (std::size_t index = 0; index < parts; ++index) {
    partNodes_.clear();
    for (; node != step.slide.nodes.end(); ++node) {
      const double u = static_cast<double>(parts) * node->u - static_cast<double>(index);
      if (u >= 1.0 && index + 1 < parts) break;
      partNodes_.push_back({u, node->weight});
    }
    if (!partNodes_.empty()) schedulePart(step, first, {index, parts, partNodes_}, sink);
  }
}

void ContactSoundScheduler::schedulePart(const SlideStep& step, bool first, const SlidePart& part,
                                         SoundSink& sink) {
  ContactState contact = step.contact;
  SampleShift shift = step.shift;
  const auto share = static_cast<double>(part.count);
  const auto index = static_cast<double>(part.index);
  if (part.count > 1) {
    contact.duration /= share;
    contact.time += index * contact.duration;
    shift = later(shift, index * contact.duration * (shift.stretch - 1.0) * settings_.sampleRate);
  }
  const SoundingBody& body = *bodies_.find(first ? contact.body : contact.other);
  Slide::Side& side = step.slide.sides[first ? 0 : 1];
  const ImpulseEvent event = SlideTracker::unitImpulse(contact, first, side.offset);
  ContactSource source = sourceOf(event, body);
  source.duration = contact.duration * shift.stretch;
  source.shift = shift;
  source.pulse = &Pulse::of(PulseShape::hertz);  // spans the step from begin to end
  source.train = part.nodes;
  source.loudest = loudestImpulse(source.train);
  source.strike.velocity = event.bodyVelocity;
  // The dipole changes gradually from that of the last step: a jump would click.
  source.dipoleBefore = side.dipole.value_or(source.strike.dipole);
  if (part.count > 1)
    source.strike.dipole =
        source.dipoleBefore + (source.strike.dipole - source.dipoleBefore) / (share - index);
  side.dipole = source.strike.dipole;
  if (!propagation_.propagate(source)) {
    ++counters_.rejectedSlides;
    return;
  }
  ScheduledSound sound = propagation_.sound();
  const bool isHeard = !sound.clicks.empty() || !sound.excitations.empty();
  if (part.index + 1 == part.count) ++(isHeard ? counters_.slides : counters_.inaudibleSlides);
  sound.train = part.nodes;
  sink.add(sound);
}

/// True if neither body can be heard, whatever impulses up to `loudest` (N s) the bumps give.
bool ContactSoundScheduler::isInaudible(const ContactState& contact, double loudest) {
  return settings_.audibleThreshold != 0.0 && isInaudible(contact, loudest, true) &&
         isInaudible(contact, loudest, false);
}

bool ContactSoundScheduler::isInaudible(const ContactState& contact, double loudest, bool first) {
  const SoundingBody& body = *bodies_.find(first ? contact.body : contact.other);
  if (body.modes != nullptr) return false;  // it may gather energy for longer than a step
  if (body.filters == nullptr) return true;
  ContactSource probe = sourceOf(SlideTracker::unitImpulse(contact, first, Vec3::Zero()), body);
  probe.duration = contact.duration;
  probe.pulse = &Pulse::of(PulseShape::hertz);
  const std::array<PulseNode, 1> train = {{{0.0, loudest}}};
  probe.train = train;
  probe.loudest = loudest;
  return propagation_.propagate(probe) && propagation_.clickPeak() < settings_.audibleThreshold;
}

}  // namespace carom::audio
